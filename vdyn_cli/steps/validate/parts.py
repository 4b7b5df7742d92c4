"""The parts of a mass on a road, driven by a torque, to whose laws a free addition can be fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.physics.laws.driveline import drive
from vdyn_cli.physics.models.road_load import DRIVELINE
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.free_profiles import KNOTS, span_of
from vdyn_cli.steps.road_load_parts import directional_force, resistance_over_speed, resistance_over_time
from vdyn_cli.steps.validate.car.prior import ParameterPrior
from vdyn_cli.steps.validate.drives.segments import DriveSegment, total_drive_torque

GAIN_ERROR = 0.05  # plausible size of a gain error: torque from motor current has 1 to 5 %
GEAR = (
    "In a car with gears, one gear's ratio or inertia makes such a curve: map the engine's speed as motor_speed, or "
    "compare parts of the drives in one gear."
)
LOSS = 0.05  # plausible size over the largest drive force: the loss of a final drive


def drive_parts(segments: Sequence[DriveSegment], prior: ParameterPrior) -> tuple[Part, ...]:
    """The driveline's force over its torque, the torque's gain over speed and time, and the resistance over these two.

    Also the force by direction where drives go both ways.

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
        _torque_gain("speed", speed, "m/s", "speed"),
        _torque_gain("elapsed", time, "s", "time of the drive"),
    ]  # fmt: skip
    if {1.0, -1.0} <= {s.heading for s in segments}:
        found.append(directional_force(speed, ("air", "wind_speed", "grade")))
    return tuple(found)


def _torque_gain(coordinate: str, span: tuple[float, float], unit: str, over: str) -> Part:
    """The relative error of the drive torque as a curve, for a map or a motor constant that is wrong in places."""
    return Part(
        "drive_torque", "", coordinate, span, GAIN_ERROR, "", unit, "the drive torque's gain", over, anchored=False,
        called="drive_torque_gain", related=("drive",), factor="value", sensor=True,
        resembles=GEAR if coordinate == "speed" else "",
    )  # fmt: skip


def torque_gain_profile(speed: tuple[float, float]) -> Effect:
    """The drive torque's gain as a free function of few waves over a range of speed, m/s."""
    part = _torque_gain("speed", speed, "m/s", "speed")
    return replace(part, called="drive_torque_gain_profile", order=KNOTS - 1).effect


def coordinate_values(part: Part, segments: Sequence[DriveSegment]) -> Array:
    """The values (n,) of a part's coordinate in all segments."""
    if part.coordinate == "drive_torque":
        return np.concatenate([total_drive_torque(s.inputs) for s in segments])
    if part.coordinate == "speed":
        return np.concatenate([s.outputs["speed"] for s in segments])
    return np.concatenate([s.since + s.time - s.time[0] for s in segments])
