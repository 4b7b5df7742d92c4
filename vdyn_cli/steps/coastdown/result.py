"""From a fitted road load to what is published of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.effects import Effect
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import FitSummary, Table
from vdyn_cli.steps.coastdown import words as coast_words
from vdyn_cli.steps.coastdown.campaign import Prepared
from vdyn_cli.steps.coastdown.lasting_force import lasting_force, resists
from vdyn_cli.steps.coastdown.odd_run import odd_run
from vdyn_cli.steps.coastdown.reference_conditions import Conditions, RoadLoad, corrected, of_parameters
from vdyn_cli.steps.coastdown.residuals import held_out_rms, run_forces
from vdyn_cli.steps.coastdown.road_load_fit import RoadLoadFit
from vdyn_cli.steps.coastdown.road_runs import noise_of
from vdyn_cli.steps.coastdown.separation import TOLD_APART, Expected, expected, wider
from vdyn_cli.steps.coastdown.times import Timed

Array = NDArray[np.float64]

SOURCE = "coastdown"
MAIN = ("rolling_resistance", "drag_area")
QUOTED = tuple(v / 3.6 for v in (60.0, 40.0, 80.0, 100.0, 20.0))  # m/s; the first that the runs pass is quoted
SPEEDS = tuple(v / 3.6 for v in range(20, 141, 20))  # m/s, of the table of forces
STILL = {"gust": 0.0, "gust_time": 8.0, "run_wind": 0.0, "run_force": 0.0}  # where plain least squares knows no gusts
UNLIKELY = 0.03  # rolling resistance above which something else than tires must be in it


@dataclass(frozen=True)
class Answer:
    """Everything the result is made of.

    Parameters
    ----------
    fixed : the main parameters that were given. test : conditions of the runs, None where the temperature is unknown.
    effects : accepted causes, in the model.
    """

    ready: Prepared
    fit: RoadLoadFit
    fixed: frozenset[str]
    test: Conditions | None
    reference: Conditions
    effects: tuple[Effect, ...] = ()

    @property
    def coasting(self) -> bool:
        return self.fit.campaign.driven == "coasting"

    @property
    def inertia(self) -> float:
        return self.fit.at["mass"] + self.fit.at["rotating_mass"]

    @cached_property
    def load(self) -> RoadLoad:
        """As tested, with what stays with the car."""
        solution, at = self.fit.solution, {**self.fit.at, **self.fit.solution.values}
        temperature = float(np.mean([r.temperature for r in self.fit.campaign.runs]))
        lasting: dict[str, Array] = {}
        for effect in filter(resists, self.effects):
            lasting |= lasting_force(effect, at, self.speeds, temperature)
        degrees = [solution.degrees[n] for n in solution.names if n in MAIN]
        return of_parameters(at, solution.names, solution.covariance, min(degrees, default=1e6), lasting)

    @cached_property
    def corrected(self) -> RoadLoad | None:
        """Under reference conditions."""
        return None if self.test is None else corrected(self.load, self.test, self.reference)

    @property
    def speeds(self) -> tuple[float, float]:
        """Slowest and fastest of the fitted runs, m/s."""
        runs = self.fit.campaign.runs
        return float(min(r.speed.min() for r in runs)), float(max(r.speed.max() for r in runs))

    @property
    def quoted(self) -> float:
        """The speed at which the road load is quoted, m/s."""
        low, high = self.speeds
        return next((v for v in QUOTED if low <= v <= high), 0.5 * (low + high))

    @cached_property
    def main(self) -> dict[str, Estimate]:
        """Rolling resistance and drag area, estimated or given."""
        solution, found = self.fit.solution, {}
        for name in MAIN:
            value = self.fit.at[name]
            std, interval = solution.std.get(name, 0.0), solution.interval95.get(name, (value, value))
            found[name] = Estimate.of(name, value, std, interval, "given" if name in self.fixed else SOURCE)
        return found

    @cached_property
    def expected(self) -> tuple[Expected | None, Expected | None]:
        """What such coasts tell of both main parameters, and what a wider window would."""
        if not self.coasting:
            return None, None
        runs, sizes = self.fit.campaign.runs, {**STILL, **self.fit.sizes}
        upper, lower = (float(np.median([r.speed[k] for r in runs])) for k in (0, -1))
        level = float(np.median([v["speed"] for v in self.fit.campaign.levels])) * sizes["speed_noise"]
        step = float(np.median([np.median(np.diff(r.time)) for r in runs]))
        now = expected(self.fit.at, sizes, level, step, (upper, lower), len(runs))
        if max(now.rolling, now.drag) <= TOLD_APART:
            return now, None
        return now, wider(self.fit.at, sizes, level, step, (upper, lower), len(runs))


def sentence(answer: Answer) -> str:
    """The closing sentence."""
    parts = []
    for name, words in zip(MAIN, ("rolling resistance", "drag area"), strict=True):
        e = answer.main[name]
        unit = f" {e.unit}" if e.unit else ""
        if name in answer.fixed:
            parts.append(f"{words} fixed at {e.value:.4g}{unit}")
        else:
            half = 0.5 * (e.interval95[1] - e.interval95[0])
            parts.append(f"{words} {coast_words.number(e.value, half)}{unit} (95 %: {coast_words.span(e.interval95)})")
    speed = answer.quoted
    force, half = float(answer.load.force(speed)), float(answer.load.half_width(speed)[0])
    runs = len(answer.fit.campaign.runs)
    kind = "run" if answer.fit.campaign.speed_fitted else "log"
    return (
        f"{parts[0][0].upper()}{parts[0][1:]} and {parts[1]}: the road load is {coast_words.number(force, half)} N at "
        f"{3.6 * speed:.0f} km/h (95 %: {coast_words.span((force - half, force + half))}), "
        f"from {runs} {kind}{'s' if runs > 1 else ''}."
    )


def parameters(answer: Answer, frontal_area: Estimate | None) -> Parameters:
    """What other steps and people read."""
    solution, load = answer.fit.solution, answer.load
    found = dict(answer.main)
    if frontal_area is not None:
        found["drag_coefficient"] = _drag_coefficient(found["drag_area"], frontal_area)
    if "driveline_efficiency" in solution.names:
        name = "driveline_efficiency"
        found[name] = Estimate.of(name, solution.values[name], solution.std[name], solution.interval95[name], SOURCE)
    half, std = load.half_widths(), np.zeros(3) if load.covariance is None else np.sqrt(np.diag(load.covariance))
    for value, h, s, name in zip(load.coefficients.tolist(), half, std, ("f0", "f1", "f2"), strict=True):
        name = f"road_load_{name}"
        source = "given" if s == 0 else SOURCE
        found[name] = Estimate.of(name, value, float(s), (value - h, value + h), source)
    full = solution.correlation
    names = [n for n in (*MAIN, "driveline_efficiency") if n in full]
    return Parameters(found, {a: {b: full[a][b] for b in names} for a in names})


def _drag_coefficient(drag_area: Estimate, area: Estimate) -> Estimate:
    """Cd = (Cd A)/A, with the area's own uncertainty."""
    value = drag_area.value / area.value
    share, own = drag_area.std / drag_area.value, area.std / area.value
    std = value * float(np.hypot(share, own))
    wide = float(np.hypot(share, own)) / share if share > 0 else 1.0
    low, high = (value + (edge - drag_area.value) / area.value * wide for edge in drag_area.interval95)
    if share == 0:
        low, high = value - 1.96 * std, value + 1.96 * std
    return Estimate.of("drag_coefficient", value, std, (low, high), drag_area.source)


def _expected_rms(fit: RoadLoadFit, channel: str) -> float:
    """What the sensor and the disturbances of the road leave between measured and simulated, were the law right."""
    level = float(np.median([levels[channel] for levels in fit.campaign.levels]))
    if channel != "speed" or fit.campaign.white:
        return level
    drift = [
        np.diag(noise_of(fit.campaign, k, fit.at).covariance(fit.sizes))[: bins.first.size]
        for k, bins in enumerate(fit.campaign.bins)
    ]
    return float(np.hypot(level, np.sqrt(np.mean(np.concatenate(drift)))))


def summary(answer: Answer) -> FitSummary:
    """How the fit went, in the channel that was fitted."""
    fit, solution = answer.fit, answer.fit.solution
    by_speed = fit.campaign.speed_fitted
    name, unit = ("speed", "m/s") if by_speed else ("acceleration", "m/s^2")
    misses = [fit.simulate(k).outputs[name] - run.channel(name) for k, run in enumerate(fit.campaign.runs)]
    return FitSummary(
        runs=tuple(r.name for r in fit.campaign.runs),
        rms=float(np.sqrt(np.mean(np.concatenate(misses) ** 2))),
        noise_floor=_expected_rms(fit, name),
        unit=unit,
        unknowns=tuple(n for n in solution.names if n not in answer.fixed),
        interval_unit=solution.unit,
        interval_units=solution.n_units,
        held_out_rms=held_out_rms(fit),
        warnings=solution.warnings,
    )


def tables(answer: Answer, laps: Sequence[Timed]) -> tuple[Table, ...]:
    loads = {"as tested": answer.load} | ({} if answer.corrected is None else {"corrected": answer.corrected})
    made = [coast_words.coefficients(loads), coast_words.forces(loads, _table_speeds(answer))]
    if laps:
        made.append(coast_words.times(laps, answer.load, answer.inertia))
    if answer.ready.rejected:
        made.append(coast_words.rejections(answer.ready.rejected))
    return tuple(made)


def _table_speeds(answer: Answer) -> list[float]:
    low, high = answer.speeds
    return [v for v in SPEEDS if low - 1.4 <= v <= high + 1.4] or [answer.quoted]


def methods(answer: Answer) -> str:
    """What was done, for the report."""
    campaign, solution, sizes = answer.fit.campaign, answer.fit.solution, answer.fit.sizes
    how = {
        "none": "The simulated speed was fitted to the measured one, with the start speed of every run free.",
        "beside": "Simulated speed and specific force were fitted together, with the start speed of every run and the "
        "accelerometer's zero free; the specific force is blind to slope, the speed is not.",
        "alone": "The specific force was fitted on the stretches driven with drive above zero; each log's zero of the "
        "accelerometer was taken from the energy of the whole log.",
    }[campaign.accelerometer]
    if campaign.white:
        noise = "Residuals were weighed as if every sample were independent: plain least squares."
    else:
        noise = (
            "Residuals were whitened with a noise model whose sizes were estimated from them by restricted maximum "
            f"likelihood: gusts of {sizes['gust']:.2f} m/s lasting {sizes['gust_time']:.0f} s and a mean wind that "
            f"differed by {sizes['run_wind']:.2f} m/s from run to run."
        )
    unit = {"run": "runs", "block": "blocks within runs", "model": "the noise model"}[solution.unit]
    text = (
        f"{how} {noise} Intervals come from {solution.n_units} {unit}. The inertia was {answer.inertia:.0f} kg, "
        f"{answer.fit.at['rotating_mass']:.0f} kg of it turning parts. {_separation(answer)}"
    )
    if answer.corrected is not None and answer.test is not None:
        text += (
            f" The correction takes the rolling part from {answer.test.temperature - 273.15:.1f} to "
            f"{answer.reference.temperature - 273.15:.1f} degC with 0.86 % per kelvin and the air part from "
            f"{answer.test.air_density:.4f} to {answer.reference.air_density:.4f} kg/m^3."
        )
    return text.strip()


def _separation(answer: Answer) -> str:
    correlation = answer.fit.solution.correlation.get(MAIN[0], {}).get(MAIN[1])
    free = correlation if not answer.fixed else None
    return coast_words.separation(free, *answer.expected)


def findings(answer: Answer) -> tuple[Finding, ...]:
    """What is doubtful about runs and result."""
    found = list(answer.ready.findings)
    if answer.coasting:  # of an open road most is left out, which the table tells
        found += [Finding(r.run, f"{r.start:.0f} to {r.stop:.0f} s left out: {r.why}") for r in answer.ready.rejected]
    if answer.test is None:
        remedy = "add 'environment: {temperature: ..., pressure: ...}'"
        found.append(Finding("environment", "the road load is not corrected: the temperature is unknown", "", remedy))
    elif not 5 <= answer.test.temperature - 273.15 <= 35:
        got = f"{answer.test.temperature - 273.15:.1f} degC"
        found.append(Finding("environment", "outside the 5 to 35 degC of SAE J1263", got))
    rolling = answer.main["rolling_resistance"].value
    if rolling > UNLIKELY:
        what = "more than tires take: a brake, an engaged driveline or a slope must be in it"
        found.append(Finding("rolling_resistance", what, f"{rolling:.4f}"))
    if answer.ready.zeros and not any(z.by_elevation for z in answer.ready.zeros.values()):
        what = "the accelerometer's zero rests on the assumption that the roads lead up as often as down"
        found.append(Finding("channels", what, remedy="map 'elevation' if the logs have it, or add more logs"))
    found += [*_odd(answer), *_moved_givens(answer)]
    return tuple(found)


def _odd(answer: Answer) -> list[Finding]:
    """A coast that is not like the others; stretches of an open road never are."""
    if not answer.coasting:
        return []
    runs = answer.fit.campaign.runs
    odd = odd_run(run_forces(answer.fit)[0], np.array([r.heading for r in runs]))
    if odd is None:
        return []
    way = "more" if odd.force > 0 else "less"
    what = f"resisted {abs(odd.force):.0f} N {way} than the other runs let expect (by chance p = {odd.chance:.1g})"
    remedy = "look at this run; leave it out if something was the matter"
    return [Finding(runs[odd.run].name, what, remedy=remedy, doubt=True)]


def _moved_givens(answer: Answer) -> list[Finding]:
    """Uncertain givens that the runs contradict."""
    found = []
    for unknown in answer.fit.campaign.unknowns:
        if unknown.prior is None or unknown.name.startswith("accelerometer"):
            continue
        mean, std = unknown.prior
        value = answer.fit.solution.values[unknown.name]
        if abs(value - mean) > 0.5 * std:
            what = f"given as {mean:.4g} +- {std:.2g}, together with the runs {value:.4g} is more likely"
            found.append(Finding(f"vehicle.{unknown.name}", what))
    return found


def extra(answer: Answer, laps: Sequence[Timed]) -> dict[str, Any]:
    """Numbers for the JSON beside the parameters."""
    speed, load = answer.quoted, answer.load
    now, better = answer.expected
    at = [{"speed_kmh": 3.6 * v, **_force(load, v)} for v in sorted({*_table_speeds(answer), speed})]
    return {
        "road_load": {
            "tested": load.document(),
            "corrected": None if answer.corrected is None else answer.corrected.document(),
            "force": at,
        },
        "accuracy": coast_words.accuracy(laps),
        "rejected": [{"run": r.run, "from_s": r.start, "to_s": r.stop, "why": r.why} for r in answer.ready.rejected],
        "separation": {"now": _as_dict(now), "wider": _as_dict(better), "words": _separation(answer)},
        "noise": dict(answer.fit.sizes),
        "accelerometer_zero": {n: {"value": z.value, "std": z.std} for n, z in answer.ready.zeros.items()},
    }


def _force(load: RoadLoad, speed: float) -> dict[str, Any]:
    force, half = float(load.force(speed)), float(load.half_width(speed)[0])
    return {"force_N": force, "interval95": [force - half, force + half]}


def _as_dict(e: Expected | None) -> dict[str, float] | None:
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
