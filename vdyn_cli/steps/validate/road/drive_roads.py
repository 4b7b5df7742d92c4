"""Roads of drives without a logged grade, from an accelerometer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.step_policy import STEP_POLICY
from vdyn_cli.steps.validate.road.road_slope import SENSED_SLOPE, RoadProfile, sensed_road


@dataclass(frozen=True, eq=False)
class DriveRoads:
    """The slope of every drive's road by its accelerometer, in addition to a logged grade; empty without.

    Parameters
    ----------
    sensed : one for each drive.
    """

    sensed: tuple[RoadProfile, ...] = ()

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the channels with the slopes."""
        return (SENSED_SLOPE,) if self.sensed else ()

    def channels(self, logs: Sequence[Log]) -> tuple[Log, ...]:
        """The logs with these slopes, each (n,) and uphill positive, as an additional channel."""
        if not self.sensed:
            return tuple(logs)
        return tuple(log.with_channels(**{SENSED_SLOPE: r.slope}) for log, r in zip(logs, self.sensed, strict=True))

    @property
    def slopes(self) -> list[Array]:
        """The slope for each log, (n,) each, uphill positive."""
        return [road.slope for road in self.sensed]


def sensed_roads(logs: Sequence[Log]) -> DriveRoads:
    """The roads of drives that their accelerometers show.

    Parameters
    ----------
    logs : with speed (m/s), and acceleration (m/s^2).
    """
    least = 1.0 - STEP_POLICY.most_missing
    there = all("acceleration" in log and np.isfinite(log["acceleration"]).mean() > least for log in logs)
    return DriveRoads(tuple(sensed_road(log) for log in logs) if there else ())
