"""A wheel's inertia from its pendulum, with the contribution of each measured quantity to the uncertainty."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from vdyn_cli.inference.uncertainty_budget import Budget, propagate
from vdyn_cli.physics.models.pendulum import (
    bar_inertia,
    bifilar_inertia,
    compound_inertia,
    small_swing,
    torsional_inertia,
)
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.quantity import Given

UNITS = {
    "period": "s",
    "amplitude": "rad",
    "mass": "kg",
    "pivot_distance": "m",
    "separation": "m",
    "length": "m",
    "gravity": "m/s^2",
    "torsional_stiffness": "N m/rad",
    "bar_mass": "kg",
    "bar_length": "m",
    "bar_diameter": "m",
    "bar_period": "s",
}
STILL = Given(0.0)


@dataclass(frozen=True)
class MeasuredPeriod:
    """A period, s, with the degrees of freedom of its standard deviation.

    ``amplitude`` (rad) is that of the timed oscillations; 0 where the period is already that of small ones.
    """

    value: Given
    degrees: float = math.inf
    amplitude: Given = STILL


def inertia_budget(kind: str, hung: Mapping[str, Given], period: MeasuredPeriod) -> Budget:
    """Moment of inertia, kg m^2, of a suspended wheel, by the formulas of ``physics.models.pendulum``.

    Parameters
    ----------
    kind : compound, bifilar or torsional.
    hung : measured quantities of the rig, by the names of ``UNITS``; for a torsion rod its stiffness, or mass, length,
        diameter and period of a calibration bar.

    Raises
    ------
    ResultError : the inertia is not positive, because the period is too short for the pivot distance.
    """

    def formula(period: float, amplitude: float = 0.0, **rig: float) -> float:
        if kind == "compound":
            return compound_inertia(small_swing(kind, period, amplitude), **rig)
        if kind == "bifilar":
            lengths = {name: rig[name] for name in ("separation", "length", "gravity")}
            return bifilar_inertia(small_swing(kind, period, amplitude, **lengths), **rig)
        return torsional_inertia(period, rod_stiffness(**rig))

    wide = {} if period.amplitude == STILL or kind == "torsional" else {"amplitude": period.amplitude}
    inputs = {"period": period.value, **wide, **hung}
    budget = propagate(formula, inputs, UNITS, {"period": period.degrees})
    if budget.value <= 0:
        shortest = 2 * math.pi * (hung["pivot_distance"].value / hung["gravity"].value) ** 0.5
        got = f"{period.value.value:.4g} s"
        what = f"the period is below {shortest:.4g} s, the shortest of any wheel at this pivot distance"
        raise ResultError(Finding("pendulum", what, got, "check pivot_distance (pivot to axle) and the period"))
    return budget


def rod_stiffness(
    torsional_stiffness: float | None = None,
    bar_mass: float = 0.0,
    bar_length: float = 0.0,
    bar_diameter: float = 0.0,
    bar_period: float = 1.0,
) -> float:
    """Stiffness of a torsion rod, N m/rad, as given or from a bar hung on it: kt = 4 pi^2 J / T^2.

    Parameters
    ----------
    torsional_stiffness : N m/rad, or None. bar_mass, bar_length, bar_diameter : kg, m, m, of a round bar.
    bar_period : s, of the bar's oscillation, mounted across the rod's axis.
    """
    if torsional_stiffness is not None:
        return torsional_stiffness
    return bar_inertia(bar_mass, bar_length, bar_diameter) * (2 * math.pi / bar_period) ** 2
