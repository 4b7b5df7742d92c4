"""The parts of the tire's curve whose laws can be replaced by free curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.physics.laws.tire_forces import friction, tire
from vdyn_cli.physics.models.tire_curve import SHAPE
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.free_part import Part, addition
from vdyn_cli.steps.free_profiles import span_of

FORCE = 100.0  # N, plausible size: some 3 % of a wheel's load
GRIP = 0.05  # plausible change of the peak friction


def tire_parts(logs: Sequence[Log], speeds_differ: bool) -> tuple[Part, ...]:
    """The parts: force over slip and returning slip, its reading over the load, friction over load and sliding speed.

    A force in addition to the curve that depends only on the load is an error of its reading: a tire without slip
    transfers nearly no force. At one speed, friction over the magnitude of the sliding speed is friction over slip.

    Parameters
    ----------
    logs : with slip and force_z (N), and vehicle_speed (m/s) where ``speeds_differ``.
    """
    slip = span_of([log["slip"] for log in logs], 0.01)
    load = span_of([log["force_z"] for log in logs], 10.0)
    middle = float(np.nanmedian(np.concatenate([log["force_z"] for log in logs])))

    def arguments(x: float, values: Mapping[str, float]) -> Mapping[str, float]:
        return {"load": middle, **{n: values[n] for n in SHAPE}}

    def grip(x: float, values: Mapping[str, float]) -> Mapping[str, float]:
        return {"load": middle, "static_load": middle, "tire_D": values["tire_D"], "tire_load_sensitivity": 0.0}

    parts = [
        Part(
            "tire", "", "slip", slip, FORCE, "N", "", "the tire's force", "slip", anchored=False, law=tire,
            arguments=arguments, own=SHAPE, related=("slip", "force_x", "friction"),
        ),
        Part(
            "friction", "", "load", load, GRIP, "", "N", "the tire's friction", "load", anchored=False, law=friction,
            arguments=grip, own=("tire_D",), related=("force_z",),
        ),
        Part("force_x", "", "load", load, FORCE, "N", "N", "the force reading", "load", anchored=False, sensor=True),
        Part(
            "tire", "", "returning", slip, FORCE, "N", "", "the tire's force", "slip while it returns to zero",
            law=addition, related=("slip",),
        ),
    ]  # fmt: skip
    if speeds_differ:
        sliding = 0.0, span_of([np.abs(log["slip"] * log["vehicle_speed"]) for log in logs], 0.1)[1]
        parts.append(
            Part(
                "friction", "", "sliding", sliding, GRIP, "", "m/s", "the tire's friction", "sliding speed",
                law=friction, arguments=grip, own=("tire_D",),
            )
        )  # fmt: skip
    return tuple(parts)
