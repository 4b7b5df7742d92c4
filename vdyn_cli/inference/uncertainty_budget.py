"""Uncertainty budget: the contribution of each input to the standard deviation of a result (GUM); weighted means."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.quantities.number_text import two_digits
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import Table

DERIVATIVE_STEP = 1e-4  # of the input; central differences of smooth formulas then have an error of 1e-8


@dataclass(frozen=True)
class Contribution:
    """One input of a result: its value, standard deviation and the sensitivity of the result.

    ``slope`` is d result / d input; ``degrees`` are the degrees of freedom of ``std`` (infinite if stated).
    """

    name: str
    value: float
    std: float
    unit: str
    slope: float
    degrees: float = math.inf

    @property
    def part(self) -> float:
        """Contribution of this input to the result's standard deviation."""
        return abs(self.slope) * self.std


@dataclass(frozen=True)
class Budget:
    """A result computed from uncertain, independent inputs.

    u^2 = sum (c_i u_i)^2, with effective degrees of freedom u^4 / sum((c_i u_i)^4 / nu_i) (Welch-Satterthwaite).
    Source: JCGM 100:2008, Guide to the expression of uncertainty in measurement, 5.1.2 and annex G.4.
    """

    value: float
    contributions: tuple[Contribution, ...]

    @property
    def std(self) -> float:
        """Combined standard uncertainty, in the unit of the value: sqrt(sum (c_i u_i)^2)."""
        return math.hypot(*(c.part for c in self.contributions))

    @property
    def degrees(self) -> float:
        """Effective degrees of freedom of ``std``, u^4 / sum((c_i u_i)^4 / nu_i); infinite if every nu_i is."""
        spread = sum(c.part**4 / c.degrees for c in self.contributions)
        return self.std**4 / spread if spread > 0 else math.inf

    @property
    def interval95(self) -> tuple[float, float]:
        """Lower and upper end: value -+ t std, with Student's t at the effective degrees of freedom."""
        half = t_quantile(min(self.degrees, 1e9)) * self.std
        return self.value - half, self.value + half

    @property
    def main(self) -> Contribution | None:
        """The input that contributes most; None where all are exact."""
        largest = max(self.contributions, key=lambda c: c.part, default=None)
        return largest if largest is not None and largest.part > 0 else None

    def table(self, key: str, title: str, unit: str, caption: str = "") -> Table:
        """One row per input: its value, its standard deviation, the result's slope, contribution and share of u^2.

        Parameters
        ----------
        key, title, caption : of the table. unit : of the result.
        """
        total = self.std**2
        rows = tuple(
            (
                c.name.replace("_", " "),
                f"{c.value:.6g} {c.unit}".strip(),
                f"{two_digits(c.std)} {c.unit}".strip() if c.std else "exact",
                f"{c.slope:.4g}",
                two_digits(c.part),
                f"{100 * c.part**2 / total:.0f} %" if total else "",
            )
            for c in sorted(self.contributions, key=lambda c: -c.part)
        )
        head = ("input", "value", "standard deviation", f"slope [{unit} per unit]", f"contributes [{unit}]", "share")
        return Table(key, title, head, (*rows, ("together", "", "", "", two_digits(self.std), "")), caption)


def propagate(
    formula: Callable[..., float],
    inputs: Mapping[str, Given],
    units: Mapping[str, str],
    degrees: Mapping[str, float] | None = None,
) -> Budget:
    """Value of ``formula(**inputs)`` and each input's contribution to its standard deviation, to first order.

    Parameters
    ----------
    formula : smooth in every input.
    inputs : values with standard deviations, independent of each other.
    units : of the inputs, for the table.
    degrees : degrees of freedom of the standard deviations that were estimated from data.
    """
    at = {name: given.value for name, given in inputs.items()}
    contributions = []
    for name, given in inputs.items():
        step = DERIVATIVE_STEP * abs(given.value) or given.std or 1e-9
        above, below = formula(**{**at, name: given.value + step}), formula(**{**at, name: given.value - step})
        slope = (above - below) / (2 * step)
        freedom = (degrees or {}).get(name, math.inf)
        contributions.append(Contribution(name, given.value, given.std, units.get(name, ""), slope, freedom))
    return Budget(formula(**at), tuple(contributions))


def weighted_mean(budgets: Mapping[str, Budget], unit: str) -> Budget:
    """The mean weighted by inverse variance; each measurement is a contribution whose slope is its weight.

    x = sum w_i x_i, w_i = u_i^-2 / sum u_j^-2. Assumes independent measurements with standard deviations above 0.

    Parameters
    ----------
    budgets : of the measurements, by name. unit : of the quantity.
    """
    weight = np.array([budget.std**-2.0 for budget in budgets.values()])
    weight = weight / weight.sum()
    value = float(weight @ np.array([budget.value for budget in budgets.values()]))
    parts = tuple(
        Contribution(name, b.value, b.std, unit, float(w), b.degrees)
        for (name, b), w in zip(budgets.items(), weight, strict=True)
    )
    return Budget(value, parts)
