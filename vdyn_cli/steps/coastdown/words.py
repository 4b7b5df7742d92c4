"""What a coast-down says, in sentences and tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vdyn_cli.quantities.result import Table
from vdyn_cli.steps.coastdown.reference_conditions import DYNO_KEYS, EPA_KEYS, RoadLoad
from vdyn_cli.steps.coastdown.selection import Rejected
from vdyn_cli.steps.coastdown.separation import Expected
from vdyn_cli.steps.coastdown.times import R83_LIMIT, WLTP_LIMIT, Timed

UNITS = ("N", "N/(km/h)", "N/(km/h)^2", "lbf", "lbf/mph", "lbf/mph^2")


def number(value: float, half: float) -> str:
    """A value with the digits that its uncertainty leaves: two digits of the half-width."""
    if not np.isfinite(half) or half <= 0:
        return f"{value:.5g}"
    digits = max(0, 1 - int(np.floor(np.log10(half))))
    return f"{value:.{min(digits, 8)}f}"


def span(interval: tuple[float, float]) -> str:
    """``0.0092 to 0.0098``"""
    half = 0.5 * (interval[1] - interval[0])
    return f"{number(interval[0], half)} to {number(interval[1], half)}"


def separation(correlation: float | None, now: Expected | None, wider: Expected | None) -> str:
    """How well rolling resistance and drag area are told apart, and what would help; no correlation: one was fixed."""
    if now is None:
        return "" if correlation is None else f"Rolling resistance and drag area are correlated by {correlation:.2f}."
    window = f"{3.6 * now.upper:.0f} to {3.6 * now.lower:.0f} km/h"
    level, state = (now.correlation, "would be") if correlation is None else (correlation, "are")
    text = (
        f"From {window} rolling resistance and drag area {state} correlated by {level:.2f}: with both free, "
        f"{now.runs} runs tell them to {now.rolling:.1%} and {now.drag:.1%} (one standard deviation)."
    )
    if wider is None:
        return text
    return (
        f"{text} From {3.6 * wider.upper:.0f} to {3.6 * wider.lower:.0f} km/h as many runs would tell them to "
        f"{wider.rolling:.1%} and {wider.drag:.1%}, correlated by {wider.correlation:.2f}."
    )


def coefficients(loads: dict[str, RoadLoad]) -> Table:
    """Dynamometer and EPA coefficients as tested and corrected, each with half its 95 % interval."""
    rows = []
    for i, (key, unit) in enumerate(zip(DYNO_KEYS + EPA_KEYS, UNITS, strict=True)):
        cells = [f"{key.split('_')[0]} [{unit}]"]
        for load in loads.values():
            value = (load.dyno() + load.epa())[i]
            half = RoadLoad(*load.half_widths().tolist())
            width = (half.dyno() + half.epa())[i]
            cells.append(f"{value:.5g} +- {width:.2g}" if width else f"{value:.5g}")
        rows.append(tuple(cells))
    return Table(
        "coefficients",
        "Road load coefficients",
        ("coefficient", *loads),
        tuple(rows),
        "F = F0 + F1 V + F2 V^2 in N and km/h; F = A + B V + C V^2 in lbf and mph. +- is half the 95 % interval of "
        "each coefficient alone: F0 and F2 move against each other, so the sum is known better than either.",
    )


def forces(loads: dict[str, RoadLoad], speeds: Sequence[float]) -> Table:
    """The force at some speeds (m/s)."""
    rows = []
    for v in speeds:
        cells = [f"{3.6 * v:.0f}"]
        for load in loads.values():
            force, half = float(load.force(v)), float(load.half_width(v)[0])
            cells.append(f"{number(force, half)} +- {half:.2g}")
        rows.append(tuple(cells))
    head = ("km/h", *(f"{name} [N]" for name in loads))
    return Table("forces", "Road load at speeds", head, tuple(rows), "+- is half the 95 % interval.")


def times(timed: Sequence[Timed], load: RoadLoad, inertia: float) -> Table:
    """Coast-down times with the accuracies of the standards, and the force they mean beside the fitted one."""
    rows = tuple(
        (
            f"{3.6 * t.speed:.0f}",
            f"{t.mean:.2f}",
            "" if t.r83 is None else f"{100 * t.r83:.1f}",
            "" if t.wltp is None else f"{100 * t.wltp:.1f}",
            f"{t.force(inertia):.0f}",
            f"{float(load.force(t.speed)):.0f}",
        )
        for t in timed
    )
    n = timed[0].pairs.size if timed else 0
    return Table(
        "times",
        f"Coast-down times of {n} pairs",
        ("km/h (+-5)", "mean time [s]", "R83 accuracy [%]", "WLTP accuracy [%]", "from the time [N]", "fitted [N]"),
        rows,
        f"Times are harmonic means of a run out and a run back. UN R83 asks for at most {100 * R83_LIMIT:g} % of at "
        f"least 4 pairs, WLTP for at most {100 * WLTP_LIMIT:g} % of at least 3; an empty cell: too few pairs. "
        "The force from the time uses no model but inertia: it should agree with the fitted one.",
    )


def accuracy(timed: Sequence[Timed]) -> dict[str, Any]:
    """The same for the JSON."""
    found: dict[str, Any] = {"pairs": int(timed[0].pairs.size) if timed else 0}
    for name, limit in (("r83", R83_LIMIT), ("wltp", WLTP_LIMIT)):
        values = [getattr(t, name) for t in timed if getattr(t, name) is not None]
        worst = max(values) if values else None
        found[name] = {"worst": worst, "limit": limit, "met": None if worst is None else worst <= limit}
    found["by_speed"] = [
        {"speed_kmh": 3.6 * t.speed, "time_s": t.mean, "pair_times_s": t.pairs.tolist(), "r83": t.r83, "wltp": t.wltp}
        for t in timed
    ]
    return found


def rejections(rejected: Sequence[Rejected]) -> Table:
    rows = tuple((r.run, f"{r.start:.1f}", f"{r.stop:.1f}", r.why) for r in rejected)
    caption = "Times are those of the log. What is listed here took no part in the fit."
    return Table("rejected", "Left out", ("run", "from [s]", "to [s]", "why"), rows, caption)
