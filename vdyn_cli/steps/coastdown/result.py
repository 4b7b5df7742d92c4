"""The published result of a fitted road load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from vdyn_cli.inference import Unknown
from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.inference.mixture import mixture_interval
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate, Parameters, normal_interval
from vdyn_cli.quantities.result import FitSummary, Result
from vdyn_cli.steps.coastdown import figures, text
from vdyn_cli.steps.coastdown.campaign_checks.coast_times import R83_LIMIT, WLTP_LIMIT, CoastTimes
from vdyn_cli.steps.coastdown.campaign_checks.expected_accuracy import ExpectedAccuracy
from vdyn_cli.steps.coastdown.doubts.agreement import LocalForces
from vdyn_cli.steps.coastdown.doubts.changed_runs import before_change
from vdyn_cli.steps.coastdown.doubts.fit_quality import physical_sizes
from vdyn_cli.steps.coastdown.doubts.result_doubts import implausible_values
from vdyn_cli.steps.coastdown.fit.reference_conditions import RoadLoad
from vdyn_cli.steps.coastdown.fit.residuals import held_out_rms
from vdyn_cli.steps.coastdown.fit.road_load_fit import MAIN, RoadLoadFit
from vdyn_cli.steps.coastdown.noise import noise_of
from vdyn_cli.steps.coastdown.quoted_speeds import quoted_speed, table_speeds
from vdyn_cli.steps.coastdown.road_load_estimates import SOURCE, RoadLoadEstimates
from vdyn_cli.steps.effect_estimates import effect_amplitudes
from vdyn_cli.steps.fit_outcome import fit_summary

SAME = 1e-6  # km/h, largest difference of two speeds that count as equal


def result_of(
    estimates: RoadLoadEstimates,
    frontal_area: Estimate | None,
    unknowns: Sequence[Unknown],
    findings: tuple[Finding, ...],
) -> Result:
    """The result of a coast-down.

    Parameters
    ----------
    frontal_area : m^2; where given, the drag coefficient is published. unknowns : of the accepted effects.
    """
    fit, load, corrected = estimates.fit, estimates.load, estimates.corrected
    loads = {"as tested": load} | ({} if corrected is None else {"corrected": corrected})
    tables = [text.coefficients(loads), text.forces(loads, table_speeds(fit.speeds))]
    tables += [text.times(estimates.times, load, fit.inertia)] if estimates.times else []
    tables += [text.influence(estimates.quality.shifts, fit)] if estimates.quality.shifts else []
    tables += [text.rejections(estimates.selection.rejected)] if estimates.selection.rejected else []
    parameters, extra = _parameters(estimates, frontal_area), _extra(estimates)
    findings += implausible_values(parameters)
    restate = partial(text.sentence, fixed=estimates.fixed, speed=quoted_speed(fit.speeds), logs=_logs(estimates))
    return Result(
        SOURCE,
        restate(parameters, extra),
        parameters,
        _summary(estimates),
        text.methods(
            fit, extra["separation"]["words"], estimates.test, estimates.reference, estimates.temperature_effect
        ),
        figures.comparisons(fit),
        figures.figures(fit, load, estimates.times, estimates.quality.local),
        tuple(tables),
        findings,
        extra,
        amplitudes=effect_amplitudes(fit.solution, unknowns),
        restate=restate,
        contradicted=estimates.quality.disagreement > 1.0,
    )


def with_answers(result: Result, answers: Sequence[tuple[float | None, Result]]) -> Result:
    """The result with 95 % force intervals that include other answers; the forces themselves are unchanged.

    low(V) = min of low_a(V) over the result, answers without a probability, and the mixture with the others; high(V)
    likewise

    Parameters
    ----------
    answers : probability and result of each, of the same campaign with other effects in the model; rows are matched by
        their speed in km/h.
    """
    load = result.extra["road_load"]
    forces = [{**row, "interval95": list(_interval(row, answers))} for row in load["force"]]
    return replace(result, extra={**result.extra, "road_load": {**load, "force": forces}})


def _interval(row: Mapping[str, Any], answers: Sequence[tuple[float | None, Result]]) -> tuple[float, float]:
    """The interval of the force in a row that includes the answers' forces at its speed."""
    rows = [(p, other) for p, one in answers for other in one.extra["road_load"]["force"]]
    there = [(p, other["interval95"]) for p, other in rows if abs(other["speed_kmh"] - row["speed_kmh"]) < SAME]
    probable = [(p, interval) for p, interval in there if p is not None]
    ends = [row["interval95"], *(interval for p, interval in there if p is None)]
    low, high = zip(*ends, *([mixture_interval(row["interval95"], probable)] if probable else []), strict=True)
    return min(low), max(high)


def _parameters(estimates: RoadLoadEstimates, frontal_area: Estimate | None) -> Parameters:
    """The estimated parameters with their correlation, and the drag coefficient where the frontal area is known."""
    solution, load = estimates.fit.solution, estimates.load
    found = dict(estimates.main)
    given = estimates.spec.settings.fix.drag_coefficient
    if given is not None:
        interval = normal_interval(given.value, given.std)
        found["drag_coefficient"] = Estimate.of("drag_coefficient", given.value, given.std, interval, "given")
    elif frontal_area is not None:
        found["drag_coefficient"] = _drag_coefficient(found["drag_area"], frontal_area)
    if (name := "driveline_efficiency") in solution.names:
        found[name] = Estimate.of(name, solution.values[name], solution.std[name], solution.interval95[name], SOURCE)
    quantile = t_quantile(min(load.degrees, 1e6))
    for k, (value, low, high) in enumerate(zip(load.coefficients.tolist(), *load.intervals(), strict=True)):
        std = max(float(value - low), float(high - value)) / quantile
        name, source = f"road_load_f{k}", "given" if std == 0 and value else SOURCE
        found[name] = Estimate.of(name, value, std, (float(low), float(high)), source)
    full = solution.correlation
    names = [n for n in (*MAIN, "driveline_efficiency") if n in full]
    return Parameters(found, {a: {b: full[a][b] for b in names} for a in names})


def _drag_coefficient(drag_area: Estimate, area: Estimate) -> Estimate:
    """Cd = (Cd A)/A, including the uncertainty of the area."""
    value = drag_area.value / area.value
    share, own = drag_area.std / drag_area.value, area.std / area.value
    std = value * float(np.hypot(share, own))
    widening = float(np.hypot(share, own)) / share if share > 0 else 1.0
    low, high = (value + (edge - drag_area.value) / area.value * widening for edge in drag_area.interval95)
    if share == 0:
        low, high = normal_interval(value, std)
    return Estimate.of("drag_coefficient", value, std, (low, high), drag_area.source)


def _summary(estimates: RoadLoadEstimates) -> FitSummary:
    """Summary of the fit in the fitted channel: rms, noise floor, unknowns, held-out error."""
    fit, solution = estimates.fit, estimates.fit.solution
    name, unit = ("speed", "m/s") if fit.campaign.speed_fitted else ("acceleration", "m/s^2")
    misses = [fit.simulate(k).outputs[name] - run.channel(name) for k, run in enumerate(fit.campaign.runs)]
    summary = fit_summary(solution, (r.name for r in fit.campaign.runs), misses, [_noise_floor(fit, name)], unit)
    unknowns = tuple(n for n in solution.names if n not in estimates.fixed and n not in fit.rows.road)
    return replace(summary, unknowns=unknowns, held_out_rms=held_out_rms(fit))


def _noise_floor(fit: RoadLoadFit, channel: str) -> float:
    """Rms expected from sensor noise and disturbances alone if the model is correct, in the channel's unit."""
    level = float(np.median([levels[channel] for levels in fit.campaign.levels]))
    if channel != "speed" or fit.campaign.white:
        return level
    at, sizes = fit.at, physical_sizes(fit)
    variances = [
        np.diag(noise_of(fit.campaign, k, at).covariance(sizes))[: bins.first.size]
        for k, bins in enumerate(fit.campaign.bins)
    ]
    return float(np.hypot(level, np.sqrt(np.mean(np.concatenate(variances)))))


def _extra(estimates: RoadLoadEstimates) -> dict[str, Any]:
    """Numbers for the JSON in addition to the parameters."""
    load, corrected, (now, wider) = estimates.load, estimates.corrected, estimates.expected
    speeds = sorted({*table_speeds(estimates.fit.speeds), quoted_speed(estimates.fit.speeds)})
    correlation = None if estimates.fixed else estimates.fit.solution.correlation.get(MAIN[0], {}).get(MAIN[1])
    return {
        "road_load": {
            "tested": load.document(),
            "corrected": None if corrected is None else corrected.document(),
            "force": [{"speed_kmh": 3.6 * v, **_force(load, v, estimates.quality.local)} for v in speeds],
        },
        "accuracy": _accuracy(estimates.times),
        "rejected": [
            {"run": r.run, "from_s": r.start, "to_s": r.stop, "length_s": r.seconds, "why": r.why}
            for r in estimates.selection.rejected
        ],
        "separation": {
            "now": _as_dict(now),
            "wider": _as_dict(wider),
            "words": text.separation(correlation, now, wider),
        },
        "noise": dict(estimates.fit.sizes),
        "quality": estimates.quality.document(),
        "accelerometer_zero": {n: {"value": z.value, "std": z.std} for n, z in estimates.zeros.items()},
    }


def _logs(estimates: RoadLoadEstimates) -> str:
    parts, kind = len(estimates.selection.segments), "run" if estimates.fit.campaign.speed_fitted else "log"
    runs = len({s.run for s in estimates.selection.segments})
    in_parts, of_car = f" in {parts} parts" if parts > runs else "", before_change(estimates.fit)
    return f"{runs} {kind}{'s' if runs > 1 else ''}{in_parts}{of_car}"


def _force(load: RoadLoad, speed: float, local: LocalForces | None) -> dict[str, Any]:
    """The force and its interval, extended to that of the local decelerations where they disagree with the fit."""
    force, (low, high) = load.force_with_interval(speed)
    if local is not None and (other := local.disagreeing(speed)) is not None:
        off, reach = other
        low, high = min(low, force + off - reach), max(high, force + off + reach)
    return {"force_N": force, "interval95": [low, high]}


def _accuracy(times: Sequence[CoastTimes]) -> dict[str, Any]:
    """Coast-down times and the standards' accuracies."""
    found: dict[str, Any] = {"pairs": int(times[0].pairs.size) if times else 0}
    for name, limit in (("r83", R83_LIMIT), ("wltp", WLTP_LIMIT)):
        worst = max((v for t in times if (v := getattr(t, name)) is not None), default=None)
        found[name] = {"worst": worst, "limit": limit, "met": None if worst is None else worst <= limit}
    found["by_speed"] = [
        {"speed_kmh": 3.6 * t.speed, "time_s": t.mean, "pair_times_s": t.pairs.tolist(), "r83": t.r83, "wltp": t.wltp}
        for t in times
    ]
    return found


def _as_dict(e: ExpectedAccuracy | None) -> dict[str, float] | None:
    if e is None:
        return None
    return {
        "from_kmh": 3.6 * e.upper,
        "to_kmh": 3.6 * e.lower,
        "runs": e.runs,
        "rolling_resistance_relative_std": e.rolling,
        "drag_area_relative_std": e.drag,
        "correlation": e.correlation,
    }
