"""Roads of drives without a logged grade, from an accelerometer or a logged elevation."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.elevation_grade import ElevationGrade, elevation_grades
from vdyn_cli.steps.validate.road_slope import ELEVATION_SLOPE, FELT_SLOPE, RoadProfile, felt_road

LEAST_ACCELERATION = 0.8  # share of the samples in which an accelerometer must have a value to give the road's slope


@dataclass(frozen=True, eq=False)
class DriveRoads:
    """The slope of every drive's road, in addition to a logged grade.

    Parameters
    ----------
    felt : from the accelerometers; empty without. elevated : from the logged elevations; empty without, or with a
        logged grade.
    """

    felt: tuple[RoadProfile, ...] = ()
    elevated: tuple[ElevationGrade, ...] = ()

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the channels with the slopes."""
        return ((FELT_SLOPE,) if self.felt else ()) + ((ELEVATION_SLOPE,) if self.elevated else ())

    def channels(self, logs: Sequence[Log]) -> tuple[Log, ...]:
        """The logs with these slopes, each (n,) and uphill positive, as additional channels."""
        for name in self.inputs:
            logs = [log.with_channels(**{name: slope}) for log, slope in zip(logs, self.slopes(name), strict=True)]
        return tuple(logs)

    def only(self, inputs: Collection[str]) -> DriveRoads:
        """The roads of these inputs."""
        return DriveRoads(self.felt if FELT_SLOPE in inputs else (), self.elevated if ELEVATION_SLOPE in inputs else ())

    def slopes(self, name: str) -> list[Array]:
        """The slope of one input for each log, (n,) each, uphill positive."""
        return [road.slope for road in self.felt] if name == FELT_SLOPE else [road.grade for road in self.elevated]


def shown_roads(logs: Sequence[Log], elevations: bool = True) -> DriveRoads:
    """The roads of drives that their accelerometers and logged elevations show.

    Parameters
    ----------
    logs : with speed (m/s), and acceleration (m/s^2) or elevation (m). elevations : whether the latter are used.
    """
    there = all("acceleration" in log and np.isfinite(log["acceleration"]).mean() > LEAST_ACCELERATION for log in logs)
    felt = tuple(felt_road(log) for log in logs) if there else ()
    return DriveRoads(felt, elevation_grades(logs) if elevations else ())
