"""The parts of a mass on a road, driven by a torque, to whose laws a free addition can be fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.physics.laws.driveline import drive
from vdyn_cli.physics.models.road_load import DRIVELINE
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.free_profiles import span_of
from vdyn_cli.steps.road_load_parts import directional_force, resistance_over_speed, resistance_over_time
from vdyn_cli.steps.validate.car.prior import ParameterPrior
from vdyn_cli.steps.validate.drives.segments import DriveSegment, total_drive_torque

LOSS = 0.05  # plausible size over the largest drive force: the loss of a final drive


def drive_parts(segments: Sequence[DriveSegment], prior: ParameterPrior) -> tuple[Part, ...]:
    """The driveline's force over its torque, and the resistance over speed, time of the drive, and direction.

    Parameters
    ----------
    segments : all simulated ones. prior : of the model's parameters, SI.
    """
    v = prior.values
    torque = np.concatenate([total_drive_torque(s.inputs) for s in segments])
    reach = float(torque.min()), float(torque.max())
    most = v["driveline_efficiency"] * v["gear_ratio"] / v["wheel_radius"] * max(abs(reach[0]), abs(reach[1]))
    speed = span_of([s.outputs["speed"] for s in segments], 1.0)
    time = span_of([s.since + s.time - s.time[0] for s in segments], 1.0)

    def driven(at: float, values: Mapping[str, float]) -> Mapping[str, float]:
        return {"whole": 1.0, **{n: values.get(n, v[n]) for n in DRIVELINE}}

    found = [
        Part(
            "drive", "", "drive_torque", reach, LOSS * most, "N", "N m", "the driveline's force", "drive torque",
            law=drive, arguments=driven, called="driveline",  # its parameters are held by their priors
        ),
        resistance_over_speed(speed, v),
        resistance_over_time("elapsed", time, "time of the drive"),
    ]  # fmt: skip
    if {1.0, -1.0} <= {s.heading for s in segments}:
        found.append(directional_force(speed, ("air", "wind_speed", "grade")))
    return tuple(found)


def coordinate_values(part: Part, segments: Sequence[DriveSegment]) -> Array:
    """The values (n,) of a part's coordinate in all segments."""
    if part.coordinate == "drive_torque":
        return np.concatenate([total_drive_torque(s.inputs) for s in segments])
    if part.coordinate == "speed":
        return np.concatenate([s.outputs["speed"] for s in segments])
    return np.concatenate([s.since + s.time - s.time[0] for s in segments])
