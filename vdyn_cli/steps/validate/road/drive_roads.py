"""Roads of drives without a logged grade, from an accelerometer or a logged elevation."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.physics.models.road_load import Slopes
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.elevation_grade import ElevationGrade, elevation_grades
from vdyn_cli.steps.step_policy import STEP_POLICY
from vdyn_cli.steps.validate.road.road_slope import ELEVATION_SLOPE, SENSED_SLOPE, RoadProfile, sensed_road


@dataclass(frozen=True, eq=False)
class DriveRoads:
    """The slope of every drive's road, in addition to a logged grade.

    Parameters
    ----------
    sensed : from the accelerometers; empty without. elevated : from the logged elevations; empty without, or with a
        logged grade.
    """

    sensed: tuple[RoadProfile, ...] = ()
    elevated: tuple[ElevationGrade, ...] = ()

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the channels with the slopes."""
        return ((SENSED_SLOPE,) if self.sensed else ()) + ((ELEVATION_SLOPE,) if self.elevated else ())

    @property
    def measured(self) -> Slopes:
        """Which sensors measured the slopes, for the model."""
        if self.sensed and self.elevated:
            return "both"
        return "sensed" if self.sensed else "elevated" if self.elevated else "known"

    def channels(self, logs: Sequence[Log]) -> tuple[Log, ...]:
        """The logs with these slopes, each (n,) and uphill positive, as additional channels."""
        for name in self.inputs:
            logs = [log.with_channels(**{name: slope}) for log, slope in zip(logs, self.slopes(name), strict=True)]
        return tuple(logs)

    def only(self, inputs: Collection[str]) -> DriveRoads:
        """The roads of these inputs."""
        sensed = self.sensed if SENSED_SLOPE in inputs else ()
        return DriveRoads(sensed, self.elevated if ELEVATION_SLOPE in inputs else ())

    def slopes(self, name: str) -> list[Array]:
        """The slope of one input for each log, (n,) each, uphill positive."""
        return [road.slope for road in self.sensed] if name == SENSED_SLOPE else [road.grade for road in self.elevated]


def shown_roads(logs: Sequence[Log], elevations: bool = True) -> DriveRoads:
    """The roads of drives that their accelerometers and logged elevations show.

    Parameters
    ----------
    logs : with speed (m/s), and acceleration (m/s^2) or elevation (m). elevations : whether the latter are used.
    """
    least = 1.0 - STEP_POLICY.most_missing
    there = all("acceleration" in log and np.isfinite(log["acceleration"]).mean() > least for log in logs)
    sensed = tuple(sensed_road(log) for log in logs) if there else ()
    return DriveRoads(sensed, elevation_grades(logs) if elevations else ())
