"""The published result of a fitted road load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.inference import Unknown
from vdyn_cli.quantities.constants import NORMAL95, ZERO_CELSIUS
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import FitSummary, Result
from vdyn_cli.steps.coastdown import figures, text
from vdyn_cli.steps.coastdown.accelerometer_zero import AccelerometerZero
from vdyn_cli.steps.coastdown.agreement import LocalForces
from vdyn_cli.steps.coastdown.campaign import Campaign
from vdyn_cli.steps.coastdown.coast_times import R83_LIMIT, WLTP_LIMIT, CoastTimes, coast_times
from vdyn_cli.steps.coastdown.expected_accuracy import (
    SEPARATED,
    CoastSetup,
    ExpectedAccuracy,
    expected_accuracy,
    wider_window,
)
from vdyn_cli.steps.coastdown.lasting_force import adds_resistance, lasting_force
from vdyn_cli.steps.coastdown.noise import noise_of
from vdyn_cli.steps.coastdown.outlying_runs import outlying_run, resistance_step
from vdyn_cli.steps.coastdown.quality import FitQuality, physical_sizes
from vdyn_cli.steps.coastdown.reference_conditions import (
    ROLLING_BY_TEMPERATURE,
    Conditions,
    RoadLoad,
    corrected_load,
    density_of,
    road_load_of,
)
from vdyn_cli.steps.coastdown.residuals import held_out_rms, run_forces
from vdyn_cli.steps.coastdown.road_load_fit import RoadLoadFit
from vdyn_cli.steps.coastdown.segments import log_of
from vdyn_cli.steps.coastdown.selection import SegmentSelection
from vdyn_cli.steps.coastdown.spec import CoastdownSpec
from vdyn_cli.steps.effect_estimates import effect_amplitudes
from vdyn_cli.steps.step_policy import STEP_POLICY

SOURCE = "coastdown"
MAIN = ("rolling_resistance", "drag_area")
QUOTED = tuple(v / 3.6 for v in (60.0, 40.0, 80.0, 100.0, 20.0))  # m/s; the first one in the fitted range is quoted
TABLE_SPEEDS = tuple(v / 3.6 for v in range(20, 141, 20))  # m/s, of the table of forces
TABLE_MARGIN = 1.4  # m/s (5 km/h) by which a table speed may lie outside the fitted speeds
NO_GUSTS = {"gust": 0.0, "gust_time": 8.0, "run_wind": 0.0, "run_force": 0.0}  # plain least squares estimates none
STANDARD_DAY = (5.0, 35.0)  # degC, SAE J1263
NOTABLE_SHIFT = 0.5  # standard deviations of a given value, above which the contradiction by the runs is reported


@dataclass(frozen=True)
class RoadLoadAnswer:
    """The fit and everything else from which the result is built.

    Parameters
    ----------
    quality : of the fit. effects : accepted effects, in the model. zeros : of the accelerometer, by run.
    """

    fit: RoadLoadFit
    spec: CoastdownSpec
    selection: SegmentSelection
    zeros: Mapping[str, AccelerometerZero]
    quality: FitQuality
    effects: tuple[Effect, ...] = ()

    @property
    def fixed(self) -> frozenset[str]:
        """The main parameters that are given instead of estimated."""
        return self.spec.settings.fix.names

    @property
    def coasting(self) -> bool:
        """Whether the drive is idle or unknown."""
        return self.fit.campaign.drive == "coasting"

    @property
    def temperature(self) -> float:
        """Mean over the runs, K."""
        return float(np.mean([r.temperature for r in self.fit.campaign.runs]))

    @cached_property
    def test(self) -> Conditions | None:
        """Air and mass during the runs; None where the temperature is unknown."""
        if self.spec.environment.temperature is None and not all(r.temperature for r in self.spec.runs):
            return None
        return Conditions(self.temperature, _air_density(self.fit), self.fit.at["mass"])

    @cached_property
    def reference(self) -> Conditions:
        """Air and mass to which the road load is corrected."""
        to = self.spec.settings.reference
        mass = to.mass.value if to.mass else self.fit.at["mass"]
        return Conditions(to.temperature.value, density_of(to.temperature.value, to.pressure.value), mass)

    @cached_property
    def load(self) -> RoadLoad:
        """The road load as tested, including the accepted effects that belong to the car."""
        return self._load_at(self.temperature)

    def _load_at(self, temperature: float) -> RoadLoad:
        """The road load in the air of the test, with the accepted effects evaluated at a temperature (K)."""
        solution, at = self.fit.solution, {**self.fit.at, "air_density": _air_density(self.fit)}
        std = dict(zip(solution.names, np.sqrt(np.diag(solution.covariance)).tolist(), strict=True))
        lasting = lasting_force([e for e in self.effects if adds_resistance(e)], at, std, self.fit.speeds, temperature)
        degrees = [solution.degrees[n] for n in solution.names if n in MAIN]
        free = min(degrees, default=1e6)
        return road_load_of(at, solution.names, solution.covariance, free, lasting)

    @cached_property
    def corrected(self) -> RoadLoad | None:
        """The road load under reference conditions; None where the temperature of the test is unknown.

        An accepted effect of temperature replaces the temperature factor of the standards.
        """
        if self.test is None:
            return None
        if _temperature_effect(self) is None:
            return corrected_load(self.load, self.test, self.reference)
        there = replace(self.test, temperature=self.reference.temperature)
        return corrected_load(self._load_at(self.reference.temperature), there, self.reference)

    @property
    def loads(self) -> dict[str, RoadLoad]:
        """The road loads that are tabulated, by name."""
        return {"as tested": self.load} | ({} if self.corrected is None else {"corrected": self.corrected})

    @cached_property
    def times(self) -> list[CoastTimes]:
        """Coast-down times of pairs of coasts."""
        return coast_times(self.selection.segments, [r.direction for r in self.spec.runs]) if self.coasting else []

    @property
    def quoted(self) -> float:
        """The speed at which the road load is quoted, m/s."""
        low, high = self.fit.speeds
        return next((v for v in QUOTED if low <= v <= high), 0.5 * (low + high))

    @property
    def table_speeds(self) -> list[float]:
        """The speeds of the table of forces, m/s."""
        low, high = self.fit.speeds
        return [v for v in TABLE_SPEEDS if low - TABLE_MARGIN <= v <= high + TABLE_MARGIN] or [self.quoted]

    @cached_property
    def main(self) -> dict[str, Estimate]:
        """Rolling resistance and drag area, estimated or given."""
        solution, found = self.fit.solution, {}
        for name in MAIN:
            value = self.fit.at[name]
            std, interval = solution.std.get(name, 0.0), solution.interval95.get(name, (value, value))
            if name == "drag_area" and std > 0 and (share := self.fit.campaign.air_share):
                wider = float(np.hypot(std, share * value)) / std
                std, interval = (
                    wider * std,
                    (value + wider * (interval[0] - value), value + wider * (interval[1] - value)),
                )
            found[name] = Estimate.of(name, value, std, interval, "given" if name in self.fixed else SOURCE)
        return found

    @cached_property
    def expected(self) -> tuple[ExpectedAccuracy | None, ExpectedAccuracy | None]:
        """Expected accuracy of such coasts, and of a wider window where they do not separate both main parameters."""
        if not self.coasting:
            return None, None
        runs, sizes = self.fit.campaign.runs, {**NO_GUSTS, **self.fit.sizes}
        window = float(np.median([r.speed[0] for r in runs])), float(np.median([r.speed[-1] for r in runs]))
        if not window[0] > window[1]:  # noise hides the fall of the speed
            return None, None
        level = float(np.median([v["speed"] for v in self.fit.campaign.levels])) * sizes["speed_noise"]
        step = float(np.median([np.median(np.diff(r.time)) for r in runs]))
        setup = CoastSetup(self.fit.at, sizes, level, step, len(runs))
        now = expected_accuracy(setup, window)
        return now, None if now.worst <= SEPARATED else wider_window(setup, window)

    @cached_property
    def separation(self) -> str:
        """How well both main parameters are separated, as a sentence."""
        correlation = self.fit.solution.correlation.get(MAIN[0], {}).get(MAIN[1])
        return text.separation(None if self.fixed else correlation, *self.expected)


def _air_density(fit: RoadLoadFit) -> float:
    """Mean over the runs, kg/m^3: a run whose temperature is stated has its own density."""
    given = fit.at["air_density"]
    return float(np.mean([given if r.air_density is None else r.air_density for r in fit.campaign.runs]))


def _temperature_effect(answer: RoadLoadAnswer) -> Effect | None:
    """The accepted effect that describes how the resistance depends on temperature, if there is one."""
    own = (e for e in answer.effects if "between_runs" in e.tags and e.lasts and "rolling" in e.on)
    return next((e for e in own if any(answer.fit.at.get(n) for n in e.unknowns)), None)


def _temperature_law(answer: RoadLoadAnswer) -> str:
    """The temperature law that corrects the rolling part, in words."""
    effect = _temperature_effect(answer)
    if effect is None:
        return f"{100 * ROLLING_BY_TEMPERATURE:.2g} % per kelvin (UN GTR 15)"
    return f"the fitted law of {effect.label}"


def result_of(
    answer: RoadLoadAnswer, frontal_area: Estimate | None, unknowns: Sequence[Unknown], findings: tuple[Finding, ...]
) -> Result:
    """The result of a coast-down.

    Parameters
    ----------
    frontal_area : m^2; where given, the drag coefficient is published. unknowns : of the accepted effects.
    """
    fit = answer.fit
    tables = [text.coefficients(answer.loads), text.forces(answer.loads, answer.table_speeds)]
    tables += [text.times(answer.times, answer.load, fit.inertia)] if answer.times else []
    tables += [answer.quality.table()] if answer.quality.shifts else []
    tables += [text.rejections(answer.selection.rejected)] if answer.selection.rejected else []
    parameters, extra = _parameters(answer, frontal_area), _extra(answer)
    findings += _implausible_drag(parameters.get("drag_coefficient"))
    restate = partial(text.sentence, fixed=answer.fixed, speed=answer.quoted, logs=_logs(fit.campaign))
    return Result(
        SOURCE,
        restate(parameters, extra),
        parameters,
        _summary(answer),
        text.methods(fit, answer.separation, answer.test, answer.reference, _temperature_law(answer)),
        figures.comparisons(fit),
        figures.figures(fit, answer.load, answer.times, answer.quality.figure(answer.load)),
        tuple(tables),
        findings,
        extra,
        amplitudes=effect_amplitudes(fit.solution, unknowns),
        restate=restate,
        contradicted=answer.quality.disagreement > 1.0,
    )


def _parameters(answer: RoadLoadAnswer, frontal_area: Estimate | None) -> Parameters:
    """The estimated parameters with their correlation, and the drag coefficient where the frontal area is known."""
    solution, load = answer.fit.solution, answer.load
    found = dict(answer.main)
    given = answer.spec.settings.fix.drag_coefficient
    if given is not None:
        low, high = given.value - NORMAL95 * given.std, given.value + NORMAL95 * given.std
        found["drag_coefficient"] = Estimate.of("drag_coefficient", given.value, given.std, (low, high), "given")
    elif frontal_area is not None:
        found["drag_coefficient"] = _drag_coefficient(found["drag_area"], frontal_area)
    if (name := "driveline_efficiency") in solution.names:
        found[name] = Estimate.of(name, solution.values[name], solution.std[name], solution.interval95[name], SOURCE)
    half, std = load.half_widths(), np.zeros(3) if load.covariance is None else np.sqrt(np.diag(load.covariance))
    for value, h, s, name in zip(load.coefficients.tolist(), half, std, ("f0", "f1", "f2"), strict=True):
        name, source = f"road_load_{name}", "given" if s == 0 else SOURCE
        found[name] = Estimate.of(name, value, float(s), (value - h, value + h), source)
    full = solution.correlation
    names = [n for n in (*MAIN, "driveline_efficiency") if n in full]
    return Parameters(found, {a: {b: full[a][b] for b in names} for a in names})


def doubts(answer: RoadLoadAnswer) -> tuple[Finding, ...]:
    """Findings about the runs and the result.

    On rejected segments, the air of the test, implausible values, the assumed zero of the accelerometer, the quality
    of the fit, outlying runs and contradicted priors.
    """
    found = []
    if answer.coasting:  # most of an open road is left out, as the table of rejected parts shows
        found += _rejected(answer.selection)
    if answer.test is None:
        remedy = "add 'environment: {temperature: ..., pressure: ...}'"
        found.append(Finding("environment", "the road load is not corrected: the temperature is unknown", "", remedy))
    elif not STANDARD_DAY[0] <= answer.test.temperature - ZERO_CELSIUS <= STANDARD_DAY[1]:
        got = f"{answer.test.temperature - ZERO_CELSIUS:.1f} degC"
        found.append(Finding("environment", "temperature outside the 5 to 35 degC of SAE J1263", got))
    rolling = answer.main["rolling_resistance"].value
    if rolling > STEP_POLICY.most_rolling:
        what = "higher than the rolling resistance of tires: it includes a brake, an engaged driveline or a slope"
        found.append(Finding("rolling_resistance", what, f"{rolling:.4f}"))
    if rolling < STEP_POLICY.least_rolling:
        what = "lower than the rolling resistance of any car's tires"
        remedy = "check the unit of the speed, the mass, and whether the car was driven"
        found.append(Finding("rolling_resistance", what, f"{rolling:.4f}", remedy, doubt=True))
    if answer.zeros and not any(z.by_elevation for z in answer.zeros.values()):
        what = "the accelerometer's zero assumes a mean slope of zero over all roads"
        found.append(Finding("channels", what, remedy="map 'elevation' if the logs have it, or add more logs"))
    return (*found, *answer.quality.findings(), *_outlying_runs(answer), *_contradicted_givens(answer))


def _rejected(selection: SegmentSelection) -> list[Finding]:
    """A note for each part of a run that is left out, and a warning for each run of which nothing is used."""
    used = {log_of(s.name) for s in selection.segments}
    lost = {log_of(r.run) for r in selection.rejected} - used
    found = []
    for r in (r for r in selection.rejected if not r.usual):
        span = f"{r.start:.0f} to {r.stop:.0f} s left out: {r.why}"
        if log_of(r.run) in lost:
            what = f"{len(lost)} of {len(used | lost)} runs not used; {span}"
            remedy = "repeat the run, or remove it from 'runs' if it is not a coast-down"
            found.append(Finding(r.run, what, "", remedy, doubt=True))
        else:
            found.append(Finding(r.run, span))
    return found


def _implausible_drag(drag: Estimate | None) -> tuple[Finding, ...]:
    """A warning if an estimated drag coefficient is outside the range of road vehicles."""
    if drag is None or drag.source == "given" or STEP_POLICY.least_drag <= drag.value <= STEP_POLICY.most_drag:
        return ()
    side = "lower" if drag.value < STEP_POLICY.least_drag else "higher"
    remedy = "check the unit of the speed, the mass and the frontal area"
    what = f"{side} than the drag coefficient of any road vehicle"
    return (Finding("drag_coefficient", what, f"{drag.value:.3f}", remedy, doubt=True),)


def _outlying_runs(answer: RoadLoadAnswer) -> list[Finding]:
    """Coasts that are outliers or from which on the resistance is higher; not tested on an open road."""
    if not answer.coasting:
        return []
    runs, found = answer.fit.campaign.runs, []
    forces, headings = run_forces(answer.fit)[0], np.array([r.heading for r in runs])
    if (step := resistance_step(forces, headings)) is not None:
        what = f"from this run on the resistance is {step.force:.0f} N higher than before (p = {step.p_value:.1g})"
        remedy = (
            "check what changed before this run (load, tire pressure, roof box, windows, wet road); "
            "if something did, describe the runs before and after the change in two files"
        )
        found.append(Finding(runs[step.run].name, what, remedy=remedy, doubt=True))
    if (outlier := outlying_run(forces, headings)) is not None:
        way, size = "higher" if outlier.force > 0 else "lower", abs(outlier.force)
        what = f"resistance is {size:.0f} N {way} than predicted from the other runs (p = {outlier.p_value:.1g})"
        remedy = "inspect this run; remove it if traffic, a brake or a gust disturbed it"
        found.append(Finding(runs[outlier.run].name, what, remedy=remedy, doubt=True))
    return found


def _contradicted_givens(answer: RoadLoadAnswer) -> list[Finding]:
    """Findings on uncertain given values that the runs contradict."""
    found = []
    for unknown in answer.fit.campaign.unknowns:
        if unknown.prior is None or unknown.name.startswith("accelerometer"):
            continue
        mean, std = unknown.prior
        value = answer.fit.solution.values[unknown.name]
        if abs(value - mean) > NOTABLE_SHIFT * std:
            what = f"given as {mean:.4g} +- {std:.2g}; the given value and the runs together give {value:.4g}"
            found.append(Finding(f"vehicle.{unknown.name}", what))
    return found


def _drag_coefficient(drag_area: Estimate, area: Estimate) -> Estimate:
    """Cd = (Cd A)/A, including the uncertainty of the area."""
    value = drag_area.value / area.value
    share, own = drag_area.std / drag_area.value, area.std / area.value
    std = value * float(np.hypot(share, own))
    widening = float(np.hypot(share, own)) / share if share > 0 else 1.0
    low, high = (value + (edge - drag_area.value) / area.value * widening for edge in drag_area.interval95)
    if share == 0:
        low, high = value - NORMAL95 * std, value + NORMAL95 * std
    return Estimate.of("drag_coefficient", value, std, (low, high), drag_area.source)


def _summary(answer: RoadLoadAnswer) -> FitSummary:
    """Summary of the fit in the fitted channel: rms, noise floor, unknowns, held-out error."""
    fit, solution = answer.fit, answer.fit.solution
    name, unit = ("speed", "m/s") if fit.campaign.speed_fitted else ("acceleration", "m/s^2")
    misses = [fit.simulate(k).outputs[name] - run.channel(name) for k, run in enumerate(fit.campaign.runs)]
    return FitSummary(
        runs=tuple(r.name for r in fit.campaign.runs),
        rms=float(np.sqrt(np.mean(np.concatenate(misses) ** 2))),
        noise_floor=_noise_floor(fit, name),
        unit=unit,
        unknowns=tuple(n for n in solution.names if n not in answer.fixed and n not in fit.rows.road),
        interval_unit=solution.unit,
        interval_units=solution.n_units,
        held_out_rms=held_out_rms(fit),
        warnings=solution.warnings,
    )


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


def _extra(answer: RoadLoadAnswer) -> dict[str, Any]:
    """Numbers for the JSON in addition to the parameters."""
    load, corrected, (now, wider) = answer.load, answer.corrected, answer.expected
    speeds = sorted({*answer.table_speeds, answer.quoted})
    return {
        "road_load": {
            "tested": load.document(),
            "corrected": None if corrected is None else corrected.document(),
            "force": [{"speed_kmh": 3.6 * v, **_force(load, v, answer.quality.local)} for v in speeds],
        },
        "accuracy": _accuracy(answer.times),
        "rejected": [
            {"run": r.run, "from_s": r.start, "to_s": r.stop, "why": r.why} for r in answer.selection.rejected
        ],
        "separation": {"now": _as_dict(now), "wider": _as_dict(wider), "words": answer.separation},
        "noise": dict(answer.fit.sizes),
        "quality": answer.quality.document(),
        "accelerometer_zero": {n: {"value": z.value, "std": z.std} for n, z in answer.zeros.items()},
    }


def _logs(campaign: Campaign) -> str:
    runs, kind = len(campaign.runs), "run" if campaign.speed_fitted else "log"
    return f"{runs} {kind}{'s' if runs > 1 else ''}"


def _force(load: RoadLoad, speed: float, local: LocalForces | None) -> dict[str, Any]:
    """The force and its interval, extended to that of the local decelerations where they disagree with the fit."""
    force, half = load.force_with_half_width(speed)
    low, high = force - half, force + half
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
