"""Sentences, methods text and tables of a coast-down."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from vdyn_cli.effects import Effect
from vdyn_cli.quantities.constants import ZERO_CELSIUS
from vdyn_cli.quantities.number_text import capitalized, number
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.result import Table
from vdyn_cli.steps.coastdown.campaign_checks.coast_times import R83_LIMIT, WLTP_LIMIT, CoastTimes
from vdyn_cli.steps.coastdown.campaign_checks.expected_accuracy import ExpectedAccuracy
from vdyn_cli.steps.coastdown.coasts.segments import RejectedSegment
from vdyn_cli.steps.coastdown.fit.reference_conditions import (
    DYNO_KEYS,
    EPA_KEYS,
    ROLLING_BY_TEMPERATURE,
    Conditions,
    RoadLoad,
)
from vdyn_cli.steps.coastdown.fit.road_load_fit import MAIN, RoadLoadFit
from vdyn_cli.steps.interval_text import ends

UNITS = ("N", "N/(km/h)", "N/(km/h)^2", "lbf", "lbf/mph", "lbf/mph^2")
FITTED = {
    "none": "Least squares fits the simulated to the measured speed, with the start speed of every run free.",
    "with_speed": "Least squares fits simulated speed and specific force together, with the start speed of every run "
    "and the accelerometer's zero free; a slope acts on the speed, but not on the specific force.",
    "alone": "Least squares fits the specific force where the drive force is positive; the accelerometer's zero in "
    "each log follows from the energy balance of the whole log.",
}


def sentence(
    estimates: Mapping[str, Estimate], extra: Mapping[str, Any], fixed: frozenset[str], speed: float, logs: str
) -> str:
    """The headline: both main parameters, and the road load at one speed.

    Parameters
    ----------
    extra : of the result, with the forces over speed. fixed : parameters that are not fitted.
    speed : at which the road load is quoted, m/s. logs : how many runs were fitted, such as "8 runs".
    """
    parts = []
    for name in MAIN:
        e = estimates[name]
        label, unit = name.replace("_", " "), f" {e.unit}" if e.unit else ""
        if name in fixed:
            parts.append(f"{label} fixed at {e.value:.4g}{unit}")
        else:
            parts.append(f"{label} {number(e.value, e.half_width)}{unit} (95 %: {ends(e.interval95)})")
    row = min(extra["road_load"]["force"], key=lambda row: abs(row["speed_kmh"] - 3.6 * speed))
    low, high = row["interval95"]
    force = number(row["force_N"], 0.5 * (high - low))
    return (
        f"{capitalized(parts[0])} and {parts[1]}: the road load is {force} N at "
        f"{3.6 * speed:.0f} km/h (95 %: {ends((low, high))}), from {logs}."
    )


def methods(
    fit: RoadLoadFit, separated: str, test: Conditions | None, reference: Conditions, effect: Effect | None
) -> str:
    """Method text of the report.

    Parameters
    ----------
    separated : sentence of ``separation``. test : conditions of the runs, None if unknown.
    effect : the accepted effect whose temperature law corrects the rolling part; None for the standards' law.
    """
    solution, sizes = fit.solution, fit.sizes
    if fit.campaign.white:
        noise = "All samples have equal weight and are assumed independent (plain least squares)."
    else:
        noise = (
            "A noise model whitens the residuals; restricted maximum likelihood estimates its amplitudes: gusts of "
            f"{sizes['gust']:.2f} m/s lasting {sizes['gust_time']:.0f} s and a mean wind that differs by "
            f"{sizes['run_wind']:.2f} m/s from run to run."
        )
        if "speed_drift" in sizes:
            noise += (
                f" The error of the measured speed that lasts for some seconds is {sizes['speed_drift']:.2g} m/s rms."
            )
    unit = {"run": "runs", "block": "blocks within runs", "model": "the noise model"}[solution.unit]
    found = (
        f"{FITTED[fit.campaign.accelerometer]} {noise} Intervals follow from {solution.n_units} {unit}. "
        f"The inertia is {fit.inertia:.0f} kg, of which {fit.at['rotating_mass']:.0f} kg are rotating parts. "
        f"{separated}"
    )
    if test is not None:
        standard = f"{100 * ROLLING_BY_TEMPERATURE:.2g} % per kelvin (UN GTR 15)"
        law = standard if effect is None else f"the fitted law of {effect.label}"
        found += (
            f" The correction takes the rolling part from {test.temperature - ZERO_CELSIUS:.1f} to "
            f"{reference.temperature - ZERO_CELSIUS:.1f} degC with {law} and the air part from "
            f"{test.air_density:.4f} to {reference.air_density:.4f} kg/m^3."
        )
    return found.strip()


def separation(correlation: float | None, now: ExpectedAccuracy | None, wider: ExpectedAccuracy | None) -> str:
    """Sentence on how well rolling resistance and drag area are separated, and which window separates them better.

    Parameters
    ----------
    correlation : of both in the fit; None where one was fixed.
    now, wider : accuracy expected from the fitted window and from a wider one; None where not computed.
    """
    if now is None:
        return "" if correlation is None else f"Rolling resistance and drag area are correlated by {correlation:.2f}."
    value, state = (now.correlation, "would be") if correlation is None else (correlation, "are")
    found = (
        f"From {3.6 * now.upper:.0f} to {3.6 * now.lower:.0f} km/h rolling resistance and drag area {state} correlated "
        f"by {value:.2f}: with both free, {now.runs} runs give standard deviations of {100 * now.rolling:.1f} % and "
        f"{100 * now.drag:.1f} %."
    )
    if wider is None:
        return found
    return (
        f"{found} From {3.6 * wider.upper:.0f} to {3.6 * wider.lower:.0f} km/h the same number of runs would give "
        f"{100 * wider.rolling:.1f} % and {100 * wider.drag:.1f} %, correlated by {wider.correlation:.2f}."
    )


def coefficients(loads: Mapping[str, RoadLoad]) -> Table:
    """Dynamometer and EPA coefficients of each road load, each with its 95 % interval.

    Parameters
    ----------
    loads : by column title.

    Returns
    -------
    Table with rows F0, F1, F2 in N and km/h, then A, B, C in lbf and mph.
    """
    published = [load.published() for load in loads.values()]
    to = " Corrected: to the reference conditions, see Methods." if "corrected" in loads else ""
    rows = [
        (f"{key.split('_')[0]} [{unit}]", *(_with_interval(*each[key]) for each in published))
        for key, unit in zip(DYNO_KEYS + EPA_KEYS, UNITS, strict=True)
    ]
    return Table(
        "coefficients",
        "Road load coefficients",
        ("coefficient", *loads),
        tuple(rows),
        "F = F0 + F1 V + F2 V^2 in N and km/h; F = A + B V + C V^2 in lbf and mph. In brackets the 95 % interval of "
        "each coefficient alone: F0 and F2 are negatively correlated, so their sum has a narrower interval." + to,
    )


def forces(loads: Mapping[str, RoadLoad], speeds: Sequence[float]) -> Table:
    """Table of the force of each road load at some speeds (m/s).

    Parameters
    ----------
    loads : by column title.
    """
    rows = []
    for v in speeds:
        each = (load.force_with_interval(v) for load in loads.values())
        rows.append((f"{3.6 * v:.0f}", *(_with_interval(force, interval) for force, interval in each)))
    head = ("km/h", *(f"{name} [N]" for name in loads))
    return Table("forces", "Road load at speeds", head, tuple(rows), "In brackets the 95 % interval.")


def times(found: Sequence[CoastTimes], load: RoadLoad, inertia: float) -> Table:
    """Table of coast-down times with the accuracies of the standards, and their force and the fitted one.

    Parameters
    ----------
    found : at least one reference speed. inertia : kg.
    """
    rows = tuple(
        (
            f"{3.6 * t.speed:.0f}",
            f"{t.mean:.2f}",
            "" if t.r83 is None else f"{100 * t.r83:.1f}",
            "" if t.wltp is None else f"{100 * t.wltp:.1f}",
            f"{t.force(inertia):.0f}",
            f"{float(load.force(t.speed)):.0f}",
        )
        for t in found
    )
    return Table(
        "times",
        f"Coast-down times of {found[0].pairs.size} pairs",
        ("km/h (+-5)", "mean time [s]", "R83 accuracy [%]", "WLTP accuracy [%]", "from the time [N]", "fitted [N]"),
        rows,
        f"Times are harmonic means of a run out and a run back. UN R83 requires at most {100 * R83_LIMIT:g} % of at "
        f"least 4 pairs, WLTP at most {100 * WLTP_LIMIT:g} % of at least 3; an empty cell means too few pairs. "
        "The accuracies use Student's t. The force from the time assumes no model but inertia: it should agree with "
        "the fitted one.",
    )


def influence(shifts: Mapping[str, Mapping[str, float]], fit: RoadLoadFit) -> Table:
    """Table of the ``shifts`` of the main parameters by each run, in half-widths of the 95 % interval."""
    halves = {n: fit.solution.half_width(n) for n in next(iter(shifts.values()))}
    rows = tuple(
        (run, *(f"{each[n]:+.2g} ({abs(each[n]) / half:.2f})" for n, half in halves.items()))
        for run, each in shifts.items()
    )
    caption = "Shift when a run is left out, to first order; in brackets in half-widths of the 95 % interval."
    columns = ("run", *(n.replace("_", " ") for n in halves))
    return Table("influence", "Influence of each run", columns, rows, caption)


def rejections(rejected: Sequence[RejectedSegment]) -> Table:
    """Table of the parts that were left out, with reasons."""
    rows = tuple((r.run, f"{r.start:.1f}", f"{r.stop:.1f}", f"{r.seconds:.1f}", r.why) for r in rejected)
    caption = "Times are those of the log. The fit does not use these parts."
    return Table("rejected", "Left out", ("run", "from [s]", "to [s]", "left out [s]", "why"), rows, caption)


def _with_interval(value: float, interval: tuple[float, float]) -> str:
    """``148.2 (146.9 to 149.5)``; the value alone where its interval is empty."""
    half = 0.5 * (interval[1] - interval[0])
    return f"{number(value, half)} ({ends(interval)})" if half > 0 else f"{value:.5g}"
