"""The result of a tire test: shape factors and slope of the fitted curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.physics.models.tire_curve import SHAPE, SHIFTS
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.effect_estimates import effect_amplitudes
from vdyn_cli.steps.fit_outcome import fit_summary
from vdyn_cli.steps.tire import figures, text
from vdyn_cli.steps.tire.fitted_curve import FittedCurve
from vdyn_cli.steps.tire.initial_slope import agreeing_with_data
from vdyn_cli.steps.tire.tire_regression import ZERO

STIFFNESS = "tire_longitudinal_stiffness"


def tire_result(
    curve: FittedCurve,
    priors: Mapping[str, tuple[float, float]],
    logs: Sequence[Log],
    formula: FittedCurve | None = None,
    finer: FittedCurve | None = None,
) -> Result:
    """The published result: all shape factors where the sweeps determine them, else only the slope at zero slip.

    Parameters
    ----------
    priors : mean and standard deviation of the stated shape factors.
    logs : of the sweeps; their findings are included.
    formula : the fit of the magic formula, which has the shape factors, where ``curve`` may depart from it.
    finer : the curve with a departure of more terms: the interval of the slope at zero includes its slope, and the
        steepest chords of both curves.
    """
    fit, solution, shaped = curve.fit, curve.solution, formula or curve
    sweeps = fit.lagged(solution.values)
    points = [fit.points(sweep, solution.values) for sweep in sweeps]
    slope, warnings = _slope(solution), tuple[str, ...]()
    if finer is not None:
        slope = _including(slope, *_slope(finer.solution).interval95)
        slope = _including(slope, slope.value, max(curve.steepest_chord, finer.steepest_chord))
    if formula is not None:
        warnings = text.departure(slope, _slope(formula.solution), formula.peak)
    elif not fit.added.effects:  # effects such as a relaxation length also act at small slips
        slope, warnings = agreeing_with_data(slope, fit.sweeps, points)
    estimates, withheld = {STIFFNESS: slope}, dict.fromkeys(SHAPE, text.WITHHELD)
    correlation = dict[str, dict[str, float]]()
    if shaped.peak is not None:
        names = (*SHAPE, *(n for n in SHIFTS if n in fit.free))
        shape = {n: _shape_factor(n, shaped) for n in names}
        if formula is not None:
            shape["tire_D"] = _with_peak(shape["tire_D"], curve)
        estimates, withheld = {**shape, **_braking(shaped), STIFFNESS: slope}, {}
        correlation = {a: {b: shaped.solution.correlation[a][b] for b in names} for a in names}
    zeros = solution.per_run.get(ZERO, np.zeros(len(fit.sweeps)))
    residuals = [near.residual(sweep) + zero for near, sweep, zero in zip(points, sweeps, zeros, strict=True)]
    peaks = () if "braking_D" in fit.free else text.two_peaks_note(fit.sweeps)
    restate = partial(text.sentence, peak=shaped.peak)
    warnings = (*warnings, *_shape_warnings(shaped))
    return Result(
        "tire",
        restate(estimates, {}),
        Parameters(estimates, correlation),
        fit_summary(solution, (s.run for s in fit.sweeps), residuals, [p.deviation for p in points], "N", warnings),
        text.METHODS,
        figures.comparisons(fit.sweeps, residuals),
        (figures.friction_over_slip(curve, shaped.peak), figures.residual_over_slip(fit.sweeps, residuals)),
        (text.sweeps_table(fit.sweeps),),
        (*text.prior_notes(priors, shaped.solution), *peaks, *(f for log in logs for f in log.findings)),
        amplitudes=effect_amplitudes(solution, fit.added.unknowns),
        withheld=withheld,
        restate=restate,
    )


def _shape_warnings(curve: FittedCurve) -> tuple[str, ...]:
    """Why the shape factors are not determined, or depend on priors or on the start of the fit."""
    if curve.peak is None:
        return (text.peak_not_reached(curve.fit.sweeps),)
    best, std = curve.solution.values["tire_C"], curve.solution.std["tire_C"]
    others = [c for c in (s.values["tire_C"] for s in curve.others) if abs(c - best) > std]
    found = (text.other_curves([best, *others[:1]]),) if others else ()
    reach = curve.fit.reach
    return (*found, text.peak_by_priors(reach, curve.peak)) if curve.peak > reach else found


def _with_peak(friction: Estimate, curve: FittedCurve) -> Estimate:
    """The peak friction of the magic formula, whose interval includes that of a ``curve`` that departs from it."""
    peak, (low, high) = curve.largest_friction, friction.interval95
    return _including(friction, peak - (high - low) / 2, peak + (high - low) / 2)


def _including(one: Estimate, low: float, high: float) -> Estimate:
    """The estimate whose interval includes the one from ``low`` to ``high``."""
    low, high = min(low, one.interval95[0]), max(high, one.interval95[1])
    return replace(one, interval95=(low, high), std=max(one.std, (high - low) / (2 * NORMAL95)))


def _shape_factor(name: str, curve: FittedCurve) -> Estimate:
    """One unknown of the curve; its interval includes those of other minima that the sweeps do not reject."""
    best = curve.solution
    ends = [s.interval95[name] for s in (best, *curve.others)]
    low, high = min(low for low, _ in ends), max(high for _, high in ends)
    wider = (high - low) / (best.interval95[name][1] - best.interval95[name][0])
    return Estimate.of(name, best.values[name], wider * best.std[name], (low, high), "tire")


def _braking(curve: FittedCurve) -> dict[str, Estimate]:
    """B and D in braking, where they are fitted: (1 + excess) times those in driving; else empty."""
    solution, found = curve.solution, {}
    for driving, excess in (("tire_B", "braking_B"), ("tire_D", "braking_D")):
        if excess in curve.fit.free:
            base, more = solution.values[driving], solution.values[excess]
            gradient, name = {driving: 1 + more, excess: base}, f"{driving}_brake"
            value = base * (1 + more)
            interval = solution.interval_of(value, gradient)
            found[name] = Estimate.of(name, value, solution.std_of(gradient), interval, "tire")
    return found


def _slope(solution: Solution) -> Estimate:
    """B C D, the slope of friction at zero slip."""
    b, c, d = (solution.values[n] for n in ("tire_B", "tire_C", "tire_D"))
    gradient = {"tire_B": c * d, "tire_C": b * d, "tire_D": b * c}
    slope = b * c * d
    return Estimate.of(STIFFNESS, slope, solution.std_of(gradient), solution.interval_of(slope, gradient), "tire")
