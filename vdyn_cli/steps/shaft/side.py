"""One side's half-shaft, measured in up to three ways: drawing, bar hung on it, log of torque and twist."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.model_builder import Correction
from vdyn_cli.inference import Solution, Unknown
from vdyn_cli.inference.uncertainty_budget import Budget, Contribution
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.shaft.fit import Adjusted, ShaftFit, Twisting
from vdyn_cli.steps.shaft.sections import Section

Array = NDArray[np.float64]

UNIT = "N m/rad"
AGREE = 2.0  # standard deviations
PLAIN = (2_900.0, 8_000.0)  # N m/rad, of a plain half-shaft of 24 to 28 mm


@dataclass(frozen=True)
class Tested:
    """What the logs of one half-shaft tell: stiffness and damping as budgets, and the adjusted readings."""

    runs: tuple[Twisting, ...]
    adjusted: tuple[Adjusted, ...]
    solution: Solution
    stiffness: Budget
    damping: Budget
    correlation: float
    sizes: Mapping[str, Given] = field(default_factory=dict)  # of the effects that the law had


@dataclass(frozen=True)
class Side:
    """A side's answers by way ("log", "bar", "drawing"), best first, and what is published of them."""

    name: str
    ways: Mapping[str, Budget]
    published: Budget
    words: str
    sections: tuple[Section, ...] = ()
    tested: Tested | None = None
    findings: tuple[Finding, ...] = field(default=())


def tested(
    runs: Sequence[Twisting],
    torque_gain_std: float,
    effects: Sequence[Correction],
    extra: Sequence[Unknown],
    known: tuple[float, float] | None,
) -> Tested:
    """Fit the runs of one side; an error of the torque's gain moves stiffness and damping alike.

    Parameters
    ----------
    effects, extra : causes in the law, and their unknowns. known : of the bar's stiffness, with standard deviation.

    Raises
    ------
    ResultError : the runs do not determine a stiffness.
    """
    fit = ShaftFit(runs, extra, effects, known)
    solution, covariance = fit.solve()
    std = np.sqrt(np.diag(covariance))
    budgets = []
    for i, (name, unit) in enumerate((("shaft_stiffness", UNIT), ("shaft_damping", "N m s/rad"))):
        value = solution.values[name]
        scatter = Contribution("scatter_of_the_data", value, float(std[i]), unit, 1.0, solution.degrees[name])
        budgets.append(Budget(value, (scatter, Contribution("torque_gain", 1.0, torque_gain_std, "", value))))
    adjusted = []
    for k in range(len(runs)):
        own = [solution.per_run[u.name][k] for u in fit.unknowns if u.per_run]
        adjusted.append(fit.adjusted(k, np.array([*solution.values.values(), *own])))
    together = covariance[0, 1] + budgets[0].value * budgets[1].value * torque_gain_std**2
    correlation = float(together / (budgets[0].std * budgets[1].std))
    stiffness, damping = budgets
    if stiffness.interval95[0] <= 0:
        got = f"{stiffness.value:.4g} +- {stiffness.std:.2g} {UNIT}"
        raise ResultError(Finding("shaft_stiffness", "the log does not determine it", got, "log a harder tip-in"))
    # A size is not known better than the noise allows, whatever the scatter of the blocks says.
    least = np.sqrt(np.diag(solution.classical_covariance))
    found = {u.name: Given(solution.values[u.name], float(max(std[2 + i], least[2 + i]))) for i, u in enumerate(extra)}
    return Tested(tuple(runs), tuple(adjusted), solution, stiffness, damping, correlation, found)


def judge(
    name: str, ways: Mapping[str, Budget], sections: Sequence[Section] = (), logged: Tested | None = None
) -> Side:
    """Publish the log's stiffness (what the car feels), else the bar's, else the drawing's; ways that agree with it
    and state their uncertainty join it, weighted by inverse variance. A gap to the drawing is read as compliance."""
    first, best = next(iter(ways.items()))
    joined = {first: best}
    findings, words = [], [f"from the {first}"]
    for other, budget in list(ways.items())[1:]:
        apart = (best.value - budget.value) / float(np.hypot(best.std, budget.std) or np.inf)
        if abs(apart) > AGREE:
            findings.append(_gap(name, first, best, other, budget, apart))
        elif budget.std > 0 and best.std > 0:
            joined[other] = budget
        words.append(f"the {other} says {budget.value:,.5g}")
    findings += _implausible(name, best)
    published = best if len(joined) == 1 else _weighted(joined)
    return Side(name, ways, published, ", ".join(words), tuple(sections), logged, tuple(findings))


def _weighted(ways: Mapping[str, Budget]) -> Budget:
    weight = np.array([b.std**-2.0 for b in ways.values()])
    weight = weight / weight.sum()
    value = float(weight @ np.array([b.value for b in ways.values()]))
    parts = [
        Contribution(n, b.value, b.std, UNIT, float(w), b.degrees)
        for (n, b), w in zip(ways.items(), weight, strict=True)
    ]
    return Budget(value, tuple(parts))


def _gap(name: str, first: str, best: Budget, other: str, budget: Budget, apart: float) -> Finding:
    got = f"{best.value:.5g} against {budget.value:.5g} {UNIT}, {abs(apart):.1f} standard deviations"
    where = f"{name}, {first} and {other}"
    if apart < 0 and other == "drawing":
        series = 1 / best.value - 1 / budget.value
        what = (
            f"the shaft is {1 - best.value / budget.value:.0%} softer than its drawing: {series:.2g} rad/(N m) in "
            "series with it, as of joints and splines, would explain it (20 to 60 % is usual)"
        )
        return Finding(where, what, got, "none needed where the joints belong to the model's shaft")
    what = "they disagree" + ("; joints can't make a shaft stiffer than its bar" if other == "drawing" else "")
    return Finding(where, what, got, "check units and gains of torque and twist, diameters, shear modulus")


def _implausible(name: str, best: Budget) -> list[Finding]:
    if PLAIN[0] <= best.value <= PLAIN[1]:
        return []
    if best.value > PLAIN[1]:
        what = f"{best.value / PLAIN[1]:.1f} times the stiffest plain half-shaft of 24 to 28 mm (2 900 to 8 000 {UNIT})"
        remedy = (
            "check diameters (fourth power) and lengths; the paper's 16 576 and 29 292 are two to four times it too"
        )
    else:
        what = f"softer than a plain half-shaft of 24 to 28 mm (2 900 to 8 000 {UNIT})"
        remedy = "check diameters (not radii), units and gear_ratio, unless it is no car's half-shaft"
    return [Finding(f"shaft_stiffness_{name}", what, f"{best.value:.5g} {UNIT}", remedy)]
