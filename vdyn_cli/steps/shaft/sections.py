"""A half-shaft's stiffness from its drawing: sections in series, solid, hollow or tapered."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vdyn_cli.inference.uncertainty_budget import Budget, propagate
from vdyn_cli.quantities.quantity import Given

# Gauss-Legendre, five points on (0, 1): good to 1e-5 for a taper of 1 to 2.
_POINTS = (0.046910077030668, 0.230765344947158, 0.5, 0.769234655052842, 0.953089922969332)
_WEIGHTS = (0.118463442528095, 0.239314335249683, 0.284444444444444, 0.239314335249683, 0.118463442528095)


SOLID = Given(0.0)


@dataclass(frozen=True)
class Section:
    """A piece between two steps of the diameter, m; ``end_diameter`` where the outside tapers."""

    outer_diameter: Given
    inner_diameter: Given
    length: Given
    end_diameter: Given | None = None


def compliance(outer: float, inner: float, length: float, shear_modulus: float, end: float | None = None) -> float:
    """Twist per torque of one section, rad/(N m).

    L / (G J), J = pi (do^4 - di^4) / 32; for a taper the integral of dx / (G J(x)) with do(x) linear.
    """
    if end is None:
        return length / (shear_modulus * polar_moment(outer, inner))
    across = (w / polar_moment(outer + (end - outer) * x, inner) for x, w in zip(_POINTS, _WEIGHTS, strict=True))
    return length / shear_modulus * sum(across)


def polar_moment(outer: float, inner: float = 0.0) -> float:
    """Polar second moment of area of a round tube, m^4: pi (do^4 - di^4) / 32."""
    return math.pi * (outer**4 - inner**4) / 32


def drawing_budget(sections: Sequence[Section], shear_modulus: Given) -> Budget:
    """Stiffness of the whole, N m/rad, 1/k = sum of the sections' compliances, with its uncertainty.

    Every diameter and length counts as measured for itself.
    """
    inputs: dict[str, Given] = {"shear_modulus": shear_modulus}
    units: dict[str, str] = {"shear_modulus": "Pa"}
    for i, section in enumerate(sections, start=1):
        for name in ("outer_diameter", "inner_diameter", "length", "end_diameter"):
            given = getattr(section, name)
            if given is not None and not (name == "inner_diameter" and given == SOLID):
                inputs[f"{name}_{i}"], units[f"{name}_{i}"] = given, "m"

    def formula(**values: float) -> float:
        return 1 / sum(
            compliance(
                values[f"outer_diameter_{i}"],
                values.get(f"inner_diameter_{i}", 0.0),
                values[f"length_{i}"],
                values["shear_modulus"],
                values.get(f"end_diameter_{i}"),
            )
            for i in range(1, len(sections) + 1)
        )

    return propagate(formula, inputs, units)


def shares(sections: Sequence[Section]) -> list[float]:
    """Each section's share of the whole compliance."""
    parts = []
    for s in sections:
        end = None if s.end_diameter is None else s.end_diameter.value
        parts.append(compliance(s.outer_diameter.value, s.inner_diameter.value, s.length.value, 1.0, end))
    return [p / sum(parts) for p in parts]


def shared_modulus_correlation(budgets: Mapping[str, Budget]) -> dict[str, dict[str, float]]:
    """Correlation of stiffnesses that were computed with one shear modulus."""
    modulus = {
        name: next((c.slope * c.std for c in b.contributions if c.name == "shear_modulus"), 0.0)
        for name, b in budgets.items()
    }

    def correlation(a: str, b: str) -> float:
        size = budgets[a].std * budgets[b].std
        return 1.0 if a == b else modulus[a] * modulus[b] / size if size else 0.0

    return {a: {b: correlation(a, b) for b in budgets} for a in budgets}
