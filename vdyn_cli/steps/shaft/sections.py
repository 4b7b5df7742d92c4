"""The stiffness of a half-shaft from its drawing: sections in series, solid, hollow or tapered."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.inference.uncertainty_budget import Budget, propagate
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.shaft.spec import SOLID, SectionSpec

GAUSS_POINTS = 5  # accurate to 1e-5 for a taper of 1 to 2


def compliance(outer: float, inner: float, length: float, shear_modulus: float, end: float | None = None) -> float:
    """Twist per torque of one section, rad/(N m).

    L / (G J), J = pi (do^4 - di^4) / 32; for a taper the integral of dx / (G J(x)) with do(x) linear.

    Parameters
    ----------
    outer, inner, end : diameters, m; ``end`` is the outside one at the other end of a taper.
    length : m. shear_modulus : Pa.
    """
    if end is None:
        return length / (shear_modulus * polar_moment(outer, inner))
    from scipy.integrate import fixed_quad

    def inverse(along: Array) -> Array:
        return np.array([1.0 / polar_moment(outer + (end - outer) * x, inner) for x in along.tolist()])

    mean, _ = fixed_quad(inverse, 0.0, 1.0, n=GAUSS_POINTS)
    return length / shear_modulus * float(mean)


def polar_moment(outer: float, inner: float = 0.0) -> float:
    """Polar second moment of area, m^4, of a round tube of these diameters (m): pi (do^4 - di^4) / 32."""
    return math.pi * (outer**4 - inner**4) / 32


def drawing_budget(sections: Sequence[SectionSpec], shear_modulus: Given) -> Budget:
    """Stiffness of the whole shaft, N m/rad, 1/k = sum of the sections' compliances, with its uncertainty.

    Assumes that the errors of all diameters and lengths are independent. ``shear_modulus`` in Pa.
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


def shares(sections: Sequence[SectionSpec]) -> list[float]:
    """Each section's share of the total compliance."""
    parts = []
    for s in sections:
        end = None if s.end_diameter is None else s.end_diameter.value
        parts.append(compliance(s.outer_diameter.value, s.inner_diameter.value, s.length.value, 1.0, end))
    return [p / sum(parts) for p in parts]


def shared_modulus_correlation(budgets: Mapping[str, Budget]) -> dict[str, dict[str, float]]:
    """Correlation of stiffnesses from drawings, by name, due to their common shear modulus.

    rho_ab = (dk_a/dG u_G) (dk_b/dG u_G) / (u_a u_b), with the standard deviation u_G of the shear modulus G
    """
    modulus = {
        name: next((c.slope * c.std for c in b.contributions if c.name == "shear_modulus"), 0.0)
        for name, b in budgets.items()
    }

    def correlation(a: str, b: str) -> float:
        size = budgets[a].std * budgets[b].std
        return 1.0 if a == b else modulus[a] * modulus[b] / size if size else 0.0

    return {a: {b: correlation(a, b) for b in budgets} for a in budgets}
