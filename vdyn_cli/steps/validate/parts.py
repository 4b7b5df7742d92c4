"""The parts of a mass on a road, driven by a torque, to whose laws a free addition can be fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.engine.model_builder import Number, Signals
from vdyn_cli.physics.laws.air_drag import air
from vdyn_cli.physics.laws.driveline import drive
from vdyn_cli.physics.laws.rolling_resistance import rolling
from vdyn_cli.physics.models.road_load import DRIVELINE
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.free_profiles import span_of
from vdyn_cli.steps.validate.car.prior import ParameterPrior
from vdyn_cli.steps.validate.drives.segments import DriveSegment, total_drive_torque

LOSS = 0.05  # plausible size over the largest drive force: the loss of a final drive
FORCE = 100.0  # N, plausible size: two thirds of a car's rolling resistance
RESISTANCES = ("air", "gust_drag", "rolling", "brake")  # laws that also act as a force over speed and time
ROAD = ("rolling_resistance", "rolling_speed", "drag_area")


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

    def rolled(at: float, values: Mapping[str, float]) -> Mapping[str, float]:
        return {n: values.get(n, v[n]) for n in (*ROAD, "mass", "air_density")}

    found = [
        Part(
            "drive", "", "drive_torque", reach, LOSS * most, "N", "N m", "the driveline's force", "drive torque",
            law=drive, arguments=driven, called="driveline",  # its parameters are held by their priors
        ),
        Part(
            "driveline", "", "speed", speed, FORCE, "N", "m/s", "the resistance to motion", "speed", anchored=False,
            law=_resistance, arguments=rolled, called="road_load", related=RESISTANCES,
        ),
        Part(
            "driveline", "", "elapsed", time, FORCE, "N", "s", "the resistance to motion", "time of the drive",
            anchored=False, called="road_load", related=RESISTANCES,
        ),
    ]  # fmt: skip
    if {1.0, -1.0} <= {s.heading for s in segments}:
        found.append(
            Part(
                "driveline", "", "speed", speed, FORCE, "N", "m/s", "the direction-dependent force (wind or slope)",
                "speed",
                anchored=False, called="directional_force", related=("air", "wind_speed", "grade"), factor="heading",
            )
        )  # fmt: skip
    return tuple(found)


def coordinate_values(part: Part, segments: Sequence[DriveSegment]) -> Array:
    """The values (n,) of a part's coordinate in all segments."""
    if part.coordinate == "drive_torque":
        return np.concatenate([total_drive_torque(s.inputs) for s in segments])
    if part.coordinate == "speed":
        return np.concatenate([s.outputs["speed"] for s in segments])
    return np.concatenate([s.since + s.time - s.time[0] for s in segments])


def _resistance(s: Signals) -> Number:
    """Rolling resistance and air drag on a level road without wind, N."""
    return rolling(s.but(load=s.mass * GRAVITY, sense=1.0)) + air(s.but(wind=0.0))
