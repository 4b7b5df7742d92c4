"""Sentences and tables of a half-shaft test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from vdyn_cli.inference.uncertainty_budget import Budget
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.number_text import capitalized, number, two_digits
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import Table
from vdyn_cli.steps.interval_text import with_interval
from vdyn_cli.steps.shaft.sections import shares
from vdyn_cli.steps.shaft.shaft_side import UNIT
from vdyn_cli.steps.shaft.stiffness_comparison import ComparedStiffness

METHODS = (
    "Drawing: compliances of the sections in series, with the uncertainties of shear modulus, diameters and lengths. "
    "Bar: torsional pendulum. Log: the readings of torque, twist and its rate, adjusted within their noise, fulfill "
    "torque = k twist + c rate + zero, and the twist is the integral of its rate (functional maximum likelihood). The "
    "noise of each channel is from its third differences; zeros of torque and rate are free in each run. Intervals "
    "follow from the scatter of blocks of equal information (Bell and McCaffrey 2002) with the second "
    "derivative of the cost. Methods that agree within two standard deviations are weighted by inverse variance; "
    "otherwise the log's value is published."
)


def sentence(estimates: Mapping[str, Estimate], _extra: Mapping[str, Any], sides: Sequence[ComparedStiffness]) -> str:
    """The headline: stiffness and damping of each side, by which methods.

    Parameters
    ----------
    estimates : by parameter. sides : with a drawing, a bar or a log, and their values by method.
    """
    parts = []
    for compared in sides:
        name, first, *others = compared.side.name, *compared.methods
        stiffness, damping = estimates[f"shaft_stiffness_{name}"], estimates.get(f"shaft_damping_{name}")
        text = f"the {name} half-shaft has {with_interval(stiffness, UNIT)}"
        if damping is not None:
            text += f" and {with_interval(damping, 'N m s/rad of damping')}"
        text += f", from the {first}"
        for budget, other in ((compared.methods[other], other) for other in others):
            text += f" (the {other} gives {number(budget.value, budget.std)})"
        parts.append(text)
    text = "; ".join(parts)
    return f"{capitalized(text)}."


def no_damping(name: str, damping: Budget, stiffness: Budget) -> Finding:
    """The finding that a damping is not published, because its interval contains zero or is negative."""
    got = f"{damping.value:.3g} +- {damping.std:.2g} N m s/rad"
    if damping.interval95[1] >= 0:
        what = "is not determined by the log and not published"
        late_std = next((c.part for c in damping.contributions if c.name == "delay_of_the_torque"), 0.0)
        if late_std > damping.std / 2**0.5:
            return Finding(name, what, got, "measure the delay of the torque, and state it under 'torque_delay'")
        return Finding(name, what, got, "log a sharper tip-in, so that the shaft oscillates")
    late = -1e3 * damping.value / stiffness.value  # T(t) = k phi(t - d) reads as k phi - k d phi'
    seen = f"the torque seems to be logged {two_digits(late)} ms or more after the twist"
    what = "is not published, because it is significantly negative, which is not physical"
    return Finding(name, what, got, f"{seen}: state 'torque_delay' under settings", doubt=True)


def assumed_delay(name: str, delay: Given, stiffness: Budget) -> Finding:
    """The finding that a damping includes a delay of the torque, s, about which nothing is stated."""
    wider = f"its interval includes a torque logged {two_digits(1e3 * NORMAL95 * delay.std)} ms late or early"
    what = f"{wider}, since no 'torque_delay' is stated: 1 ms late lowers it by {1e-3 * stiffness.value:.2g} N m s/rad"
    remedy = "state the torque's delay behind twist and speeds under settings, such as 'torque_delay: 0 +- 0.05 ms'"
    return Finding(name, what, remedy=remedy)


def tables(sides: Sequence[ComparedStiffness]) -> tuple[Table, ...]:
    """Tables of the drawings' sections, of the stiffness by each method, and of the uncertainty of each."""
    found = [table for table in (_sections(sides), _methods(sides)) if table.rows]
    for compared in sides:
        for method, budget in compared.methods.items():
            title = f"Uncertainty of the {method}, {compared.side.name}"
            found.append(budget.table(f"{method}_budget_{compared.side.name}", title, UNIT))
    return tuple(found)


def _sections(sides: Sequence[ComparedStiffness]) -> Table:
    rows = []
    for side in (compared.side for compared in sides):
        for i, (s, share) in enumerate(zip(side.sections, shares(side.sections), strict=True)):
            end = "" if s.end_diameter is None else f" to {1000 * s.end_diameter.value:.2f}"
            cells = (f"{1000 * s.outer_diameter.value:.2f}{end}", f"{1000 * s.inner_diameter.value:.2f}",
                     f"{1000 * s.length.value:.1f}", f"{100 * share:.1f} %")  # fmt: skip
            rows.append((side.name, str(i + 1), *cells))
    columns = ("side", "section", "outer diameter [mm]", "inner diameter [mm]", "length [mm]", "share of the twist")
    return Table("sections", "The drawing", columns, tuple(rows))


def _methods(sides: Sequence[ComparedStiffness]) -> Table:
    rows = [
        (c.side.name, method, f"{b.value:.5g}", two_digits(b.std), f"{b.interval95[0]:.5g} to {b.interval95[1]:.5g}")
        for c in sides
        for method, b in c.methods.items()
    ]
    columns = ("side", "from", f"stiffness [{UNIT}]", "standard deviation", "95 %")
    return Table("ways", "Stiffness by each method", columns, tuple(rows))
