"""Comparison of one side's stiffness by log, pendulum bar and drawing, and the published value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference.uncertainty_budget import Budget, weighted_mean
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.interval_text import with_interval
from vdyn_cli.steps.shaft.shaft_side import UNIT, LoggedShaft, ShaftSide
from vdyn_cli.steps.step_policy import STEP_POLICY

PLAIN = (2_900.0, 8_000.0)  # N m/rad: plain steel half-shafts of 24 to 28 mm, 600 to 900 mm long


@dataclass(frozen=True)
class ComparedStiffness:
    """A side's stiffness, N m/rad, by method ("log", "bar", "drawing"), best first, and the published one."""

    side: ShaftSide
    methods: Mapping[str, Budget]
    logged: LoggedShaft | None
    published: Budget
    findings: tuple[Finding, ...]


def compared_stiffness(side: ShaftSide, logged: LoggedShaft | None) -> ComparedStiffness:
    """Publish the log's stiffness (that of the car), else the bar's, else the drawing's.

    Methods that agree with it and have an uncertainty are averaged with it, weighted by inverse variance. A method that
    contradicts it is reported with both numbers and does not change it: a measured value keeps its interval. A log that
    is softer than its drawing shows further compliance in series.
    """
    given = {"log": logged.stiffness if logged else None, "bar": side.bar, "drawing": side.drawing}
    methods = {name: budget for name, budget in given.items() if budget is not None}
    first, best = next(iter(methods.items()))
    joined, findings = {first: best}, []
    for other, budget in list(methods.items())[1:]:
        apart = (best.value - budget.value) / float(np.hypot(best.std, budget.std) or np.inf)
        if abs(apart) > STEP_POLICY.agreeing_std:
            got = f"{with_interval(best)} against {with_interval(budget, UNIT)}, {abs(apart):.1f} standard deviations"
            softer = best.value < budget.value and other == "drawing"
            what, remedy = _disagreement((first, best), (other, budget))
            findings.append(Finding(f"{side.name}, {first} and {other}", what, got, remedy, doubt=not softer))
        elif budget.std > 0 and best.std > 0:
            joined[other] = budget
    findings += _implausible(side.name, best)
    published = joined[first] if len(joined) == 1 else weighted_mean(joined, UNIT)
    return ComparedStiffness(side, methods, logged, published, tuple(findings))


def _disagreement(published: tuple[str, Budget], contradicting: tuple[str, Budget]) -> tuple[str, str]:
    """Fact and remedy of a disagreement between two methods, each with its name."""
    (first, best), (other, budget) = published, contradicting
    ours = f"that of the {first} is published"
    if best.value < budget.value and other == "drawing":
        series = 1 / best.value - 1 / budget.value
        return (
            f"the shaft is {100 * (1 - best.value / budget.value):.0f} % softer than calculated from its drawing: "
            f"joints and splines with {series:.2g} rad/(N m) in series would explain it (20 to 60 % is usual), and an "
            f"error of the drawing of this size looks the same; {ours}"
        ), "none, if the joints belong to the shaft of the model; else check diameters (fourth power), shear modulus"
    joints = "; joints cannot make a shaft stiffer than its bar" if other == "drawing" else ""
    remedy = "check units and gains of torque and twist, diameters, shear modulus"
    return f"the stiffnesses differ{joints}; {ours}", remedy


def _implausible(name: str, best: Budget) -> list[Finding]:
    if PLAIN[0] <= best.value <= PLAIN[1]:
        return []
    if best.value > PLAIN[1]:
        what = f"{best.value / PLAIN[1]:.1f} times the stiffest plain half-shaft of 24 to 28 mm (2 900 to 8 000 {UNIT})"
        published = f"SAE 2017-01-1574 publishes 16 576 and 29 292 {UNIT}"
        remedy = f"check diameters (fourth power) and lengths; {published}"
    else:
        what = f"softer than a plain half-shaft of 24 to 28 mm (2 900 to 8 000 {UNIT})"
        remedy = "check diameters (not radii), units and gear_ratio, unless this is not the half-shaft of a car"
    return [Finding(f"shaft_stiffness_{name}", what, f"{best.value:.5g} {UNIT}", remedy)]
