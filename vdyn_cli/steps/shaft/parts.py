"""The parts of a half-shaft whose laws can be replaced by free curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.physics.laws.torsion_shaft import shaft
from vdyn_cli.steps.free_part import Part

TORQUE = 50.0  # N m, plausible size: a tenth of a tip-in's torque


def shaft_parts(sides: Sequence[str], twist: tuple[float, float], rate: tuple[float, float]) -> tuple[Part, ...]:
    """The parts: the shafts' torque over twist and over its rate.

    Parameters
    ----------
    sides : the logged ones; the first provides stiffness and damping. twist, rate : spans, rad and rad/s.
    """
    stiffness, damping = (f"shaft_{name}_{sides[0]}" for name in ("stiffness", "damping"))

    def arguments(x: float, values: Mapping[str, float]) -> Mapping[str, float]:
        return {"twist": 0.0, "twist_rate": 0.0, "stiffness": values[stiffness], "damping": values[damping]}

    def part(coordinate: str, span: tuple[float, float], unit: str, over: str, own: str) -> Part:
        return Part(
            "shaft", "", coordinate, span, TORQUE, "N m", unit, "the half-shaft's torque", over, law=shaft,
            arguments=arguments, own=(own,), odd=True,
        )  # fmt: skip

    over_twist = part("twist", twist, "rad", "twist", stiffness)
    return (over_twist, part("twist_rate", rate, "rad/s", "rate of twist", damping))


def symmetric_span(logs: Sequence[np.ndarray]) -> tuple[float, float]:
    """The smallest span symmetric about zero that contains all finite values."""
    most = max((float(np.nanmax(np.abs(x))) for x in logs if x.size), default=1.0)
    return -most, most
