"""Figures of a half-shaft test: torque over twist, its residual, sections of the drawing, comparison of methods."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.result import Comparison, Figure, Series
from vdyn_cli.steps.shaft.sections import shares
from vdyn_cli.steps.shaft.shaft_side import UNIT, LoggedShaft, ShaftSide
from vdyn_cli.steps.shaft.stiffness_comparison import ComparedStiffness


def comparisons(sides: Sequence[ComparedStiffness]) -> tuple[Comparison, ...]:
    """Measured torque of each logged run, and the law's torque at its adjusted twist."""
    return tuple(
        Comparison(run.name, "shaft_torque", "N m", run.time, "time in s", run.torque, torque)
        for logged in (compared.logged for compared in sides)
        if logged is not None
        for run, torque in zip(logged.runs, logged.torque, strict=True)
    )


def figures(sides: Sequence[ComparedStiffness]) -> tuple[Figure, ...]:
    """Loop and residual of each logged side, sections of each drawing, and methods where there are several."""
    found = [draw(c.side.name, c.logged) for c in sides if c.logged is not None for draw in (_loop, _residual)]
    found += [_compliance(c.side) for c in sides if len(c.side.sections) > 1]
    if any(len(compared.methods) > 1 for compared in sides):
        found.append(_methods(sides))
    return tuple(found)


def _loop(name: str, logged: LoggedShaft) -> Figure:
    stiffness, damping = logged.solution.values["shaft_stiffness"], logged.solution.values["shaft_damping"]
    zeros = logged.solution.per_run["torque_zero"]
    series = [
        Series(run.name, np.degrees(twist), run.torque - zero - damping * rate, "points")
        for run, twist, rate, zero in zip(logged.runs, logged.twist, logged.rate, zeros, strict=True)
    ]
    ends = np.array([min(t.min() for t in logged.twist), max(t.max() for t in logged.twist)])
    series.append(Series(f"{stiffness:.4g} {UNIT}", np.degrees(ends), stiffness * ends, role="simulated"))
    caption = (
        "Measured torque, minus damping and zero, over the twist. Good: one straight band through the origin. Bad: a "
        "flat segment around zero (backlash), a curve (a joint that stiffens, a rubber coupling), an open loop "
        "(damping that does not follow the rate, or torque and twist on different clocks)."
    )
    return Figure(f"loop_{name}", f"Torque over twist, {name}", caption, "twist in deg", "torque in N m", tuple(series))


def _residual(name: str, logged: LoggedShaft) -> Figure:
    series = tuple(
        Series(run.name, run.time, run.torque - torque, role="residual")
        for run, torque in zip(logged.runs, logged.torque, strict=True)
    )
    caption = (
        "Torque that stiffness and damping do not explain. Good: noise of one height. Bad: ringing after each tip-in "
        "(another damping law, a clock offset), spikes where the torque changes sign (backlash), a drift (twist zero)."
    )
    return Figure(f"torque_residual_{name}", f"Residual torque, {name}", caption, "time in s", "N m", series)


def _compliance(side: ShaftSide) -> Figure:
    share = 100 * np.array(shares(side.sections))
    series = Series(side.name, np.arange(1.0, 1 + share.size), share, "bars")
    caption = (
        "Contribution of each section of the drawing to the twist. The tallest bars matter most: their diameter "
        "enters with the fourth power, so 1 % of it is 4 % of their twist."
    )
    key, title = f"compliance_{side.name}", f"Twist of each section, {side.name}"
    return Figure(key, title, caption, "section, from the inside out", "share of the twist in %", (series,))


def _methods(sides: Sequence[ComparedStiffness]) -> Figure:
    """Stiffness by each method relative to the published one of its side."""
    series, at = [], 0
    for compared in sides:
        budgets, published = compared.methods.values(), compared.published.value
        x = np.arange(at, at + len(budgets), dtype=np.float64)
        at += len(budgets) + 1
        value = np.array([100 * (b.value / published - 1) for b in budgets])
        half = np.array([100 * (b.interval95[1] - b.value) / published for b in budgets])
        series.append(Series(f"{compared.side.name}: {', '.join(compared.methods)}", x, value, "points", error=half))
    caption = (
        "Stiffness by each method, in the order of the legend, minus the published one, with 95 % intervals. Good: "
        "those of one side overlap. A log below its drawing: joints and splines twist too. A log above it: check "
        "gains, units and diameters."
    )
    y_label = "stiffness minus the published one in %"
    return Figure("ways", "Drawing against measurement", caption, "method", y_label, tuple(series))
