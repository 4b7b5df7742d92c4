"""What to show of half-shafts: torque over twist, its residual, the drawing's sections, the ways compared."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.inference.uncertainty_budget import two_digits
from vdyn_cli.quantities.result import Comparison, Figure, Series, Table
from vdyn_cli.steps.shaft.sections import shares
from vdyn_cli.steps.shaft.side import UNIT, Side, Tested


def comparisons(sides: Sequence[Side]) -> tuple[Comparison, ...]:
    """Torque of each logged run against the torque that its twist calls for."""
    return tuple(
        Comparison(run.name, "shaft_torque", "N m", run.time, "time in s", run.torque, adjusted.torque)
        for side in sides
        if side.tested
        for run, adjusted in zip(side.tested.runs, side.tested.adjusted, strict=True)
    )


def figures(sides: Sequence[Side]) -> tuple[Figure, ...]:
    found = [draw(side.name, side.tested) for side in sides if side.tested for draw in (_loop, _residual)]
    found += [_compliance(side) for side in sides if len(side.sections) > 1]
    if any(len(side.ways) > 1 for side in sides):
        found.append(_ways(sides))
    return tuple(found)


def _loop(name: str, tested: Tested) -> Figure:
    stiffness, damping = tested.solution.values["shaft_stiffness"], tested.solution.values["shaft_damping"]
    series = []
    ends = np.array([np.inf, -np.inf])
    for k, (run, adjusted) in enumerate(zip(tested.runs, tested.adjusted, strict=True)):
        zero = tested.solution.per_run["torque_zero"][k]
        spring = run.torque - zero - damping * adjusted.rate
        series.append(Series(run.name, np.degrees(adjusted.twist), spring, "points"))
        ends = np.array([min(ends[0], adjusted.twist.min()), max(ends[1], adjusted.twist.max())])
    series.append(Series(f"{stiffness:.4g} {UNIT}", np.degrees(ends), stiffness * ends, role="simulated"))
    caption = (
        "Measured torque, less damping and zero, over the twist. Good: one straight band through the origin. Bad: a "
        "flat stretch around zero (backlash), a bend (a joint that stiffens, a rubber coupling), an open loop (damping "
        "that does not follow the rate, or torque and twist on different clocks)."
    )
    return Figure(f"loop_{name}", f"Torque over twist, {name}", caption, "twist in deg", "torque in N m", tuple(series))


def _residual(name: str, tested: Tested) -> Figure:
    series = tuple(
        Series(run.name, run.time, run.torque - adjusted.torque, role="residual")
        for run, adjusted in zip(tested.runs, tested.adjusted, strict=True)
    )
    caption = (
        "Torque that stiffness and damping do not explain. Good: noise of one height. Bad: ringing after each tip-in "
        "(another damping law, a clock offset), spikes where the torque changes sign (backlash), a drift (twist zero)."
    )
    return Figure(f"torque_residual_{name}", f"Residual torque, {name}", caption, "time in s", "N m", series)


def _compliance(side: Side) -> Figure:
    share = 100 * np.array(shares(side.sections))
    series = Series(side.name, np.arange(1.0, 1 + share.size), share, "bars")
    caption = (
        "How much each section of the drawing adds to the twist. The tallest bars decide: their diameter enters with "
        "the fourth power, so 1 % of it is 4 % of their twist."
    )
    x_label, y_label = "section, from the inside out", "share of the twist in %"
    return Figure(
        f"compliance_{side.name}", f"Where the {side.name} shaft twists", caption, x_label, y_label, (series,)
    )


def _ways(sides: Sequence[Side]) -> Figure:
    """Each way relative to what is published of its side."""
    series, at = [], 0
    for side in sides:
        x = np.arange(at, at + len(side.ways), dtype=np.float64)
        at += len(side.ways) + 1
        value = np.array([100 * (b.value / side.published.value - 1) for b in side.ways.values()])
        half = np.array([100 * (b.interval95[1] - b.value) / side.published.value for b in side.ways.values()])
        series.append(Series(f"{side.name}: {', '.join(side.ways)}", x, value, "points", error=half.astype(np.float64)))
    caption = (
        "Stiffness by each way, in the order of the legend, less the published one, with 95 % intervals. Good: those "
        "of one side overlap. A log below its drawing: joints and splines twist too. A log above it: check gains, "
        "units and diameters."
    )
    y_label = "stiffness less the published one in %"
    return Figure("ways", "Drawing against measurement", caption, "way", y_label, tuple(series))


def tables(sides: Sequence[Side]) -> tuple[Table, ...]:
    found = [t for t in (_sections_table(sides), _ways_table(sides)) if t.rows]
    for side in sides:
        for way, budget in side.ways.items():
            title = f"Uncertainty of the {way}, {side.name}"
            found.append(budget.table(f"{way}_budget_{side.name}", title, UNIT))
    return tuple(found)


def _sections_table(sides: Sequence[Side]) -> Table:
    rows = []
    for side in sides:
        for i, (s, share) in enumerate(zip(side.sections, shares(side.sections) if side.sections else [], strict=True)):
            end = "" if s.end_diameter is None else f" to {1000 * s.end_diameter.value:.2f}"
            cells = (f"{1000 * s.outer_diameter.value:.2f}{end}", f"{1000 * s.inner_diameter.value:.2f}",
                     f"{1000 * s.length.value:.1f}", f"{share:.1%}")  # fmt: skip
            rows.append((side.name, str(i + 1), *cells))
    columns = ("side", "section", "outer diameter [mm]", "inner diameter [mm]", "length [mm]", "share of the twist")
    return Table("sections", "The drawing", columns, tuple(rows))


def _ways_table(sides: Sequence[Side]) -> Table:
    rows = [
        (side.name, way, f"{b.value:.5g}", two_digits(b.std), f"{b.interval95[0]:.5g} to {b.interval95[1]:.5g}")
        for side in sides
        for way, b in side.ways.items()
    ]
    columns = ("side", "from", f"stiffness [{UNIT}]", "standard deviation", "95 %")
    return Table("ways", "Stiffness by each way", columns, tuple(rows))
