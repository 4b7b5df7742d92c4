"""Contribution of input uncertainties to the published intervals, if the scatter of the data does not show them.

A channel computed as a scale times another one has the relative error of the scale in all samples of all runs; the
channels of another logger have the error of its clock in all samples of a run. The step is published again with the
logs shifted by one standard deviation of each::

    slope = p(shifted) - p        for a scale
    slope = (p(+) - p(-)) / 2     for a clock, so that the effect of resampling cancels
    std'  = sqrt(std^2 + sum slope^2)

with p the parameters of the model, including the effects that extend it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.diagnosis.extend.published_answers import publish_with
from vdyn_cli.effects import candidates
from vdyn_cli.project.inputs import Inputs
from vdyn_cli.project.reading.channel_sources import Scaling
from vdyn_cli.project.reading.road_profile import with_survey_error
from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.errors import Finding, InputError, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import Failure, published
from vdyn_cli.steps.road_survey import MODES, RoadSurvey
from vdyn_cli.steps.wider_intervals import with_wider_intervals

Slopes = Mapping[str, float]
SHOWN = 1.02  # times the half width: smaller increases are not visible in two digits


@dataclass(frozen=True)
class _Uncertain:
    """One independent uncertainty: its name, place and size, and the log shifted by a number of standard deviations."""

    name: str
    where: str
    size: str
    moved: Callable[[Log, float], Log]
    both_ways: bool


def with_input_uncertainty(result: Result, inputs: Inputs) -> Result:
    """The result with intervals that include the uncertainty of scaled channels, clocks and the road survey.

    Parameters
    ----------
    result : diagnosed, of the extended model if there is one. inputs : of the step.
    """
    uncertain = [*_scales(inputs), *_clocks(inputs), *_road(inputs)]
    if not uncertain or result.refused:
        return result
    effects = result.diagnosis.extended if result.diagnosis else ()
    slopes, left_out = [], []
    for one in uncertain:
        found = _slope(result.parameters, inputs, effects, one) if result.parameters else {}
        if found:
            slopes.append(found)
        else:
            what = f"the intervals do not include the uncertainty of {one.name} ({one.size})"
            left_out.append(Finding(one.where, what, doubt=True))
    if not slopes:
        return replace(result, findings=(*result.findings, *left_out))
    parameters = _widened(result.parameters, slopes)
    shown = any(e.half_width > SHOWN * result.parameters[n].half_width for n, e in parameters.items())
    why = " and ".join(dict.fromkeys(one.name for one in uncertain))
    note = f"The intervals include the uncertainty of {why}." if shown else ""
    return replace(with_wider_intervals(result, parameters, note), findings=(*result.findings, *left_out))


def _scales(inputs: Inputs) -> Iterator[_Uncertain]:
    """The uncertain scales of channels computed from others, which the step's model does not have."""
    for one in inputs.scalings:
        if one.relative_std > 0 and not one.channel.in_model and any(one.channel.source in log for log in inputs.logs):
            name = " and ".join(n for n, e in one.constants.items() if e.std > 0)
            size = f"{one.relative_std:.2g} of the channel"
            yield _Uncertain(name, one.channel.target, size, _scaled(one), both_ways=False)


def _scaled(scaling: Scaling) -> Callable[[Log, float], Log]:
    name = scaling.channel.target

    def moved(log: Log, times: float) -> Log:
        factor = 1.0 + times * scaling.relative_std
        return log.with_channels(**{name: factor * log[name]}) if name in log else log

    return moved


def _clocks(inputs: Inputs) -> Iterator[_Uncertain]:
    """Delay and, if corrected, drift of each other logger of each run."""
    times = {log.name: log.time for log in inputs.logs}
    for one in inputs.clocks:
        std = one.run_delay_std(times[one.run]) if one.run in times else one.delay_std
        kinds = [("the clocks' delay", f"{std:.2g} s", std, 0.0)]
        if one.corrected:
            kinds.append(("the clocks' drift", f"{1e6 * one.drift_std:.2g} ppm", 0.0, one.drift_std))
        for name, size, delay, drift in kinds:
            fitted = bool(delay) and not one.stated and not set(inputs.step.fits_clocks).isdisjoint(one.channels)
            if one.channels and not fitted:
                yield _Uncertain(name, one.logger, size, _shifted(one, delay, drift), both_ways=True)


def _road(inputs: Inputs) -> Iterator[_Uncertain]:
    """The modes of the error of the road survey."""
    road = inputs.road
    for mode in range(MODES if road is not None and road.uncertain else 0):
        if road is not None:
            yield _Uncertain("the road survey", road.name, road.size, _resurveyed(road, mode), both_ways=False)


def _resurveyed(road: RoadSurvey, mode: int) -> Callable[[Log, float], Log]:
    def moved(log: Log, times: float) -> Log:
        return with_survey_error(log, road, mode, times)

    return moved


def _shifted(clock: ClockDifference, delay: float, drift: float) -> Callable[[Log, float], Log]:
    def moved(log: Log, times: float) -> Log:
        if log.name != clock.run and not log.name.startswith(f"{clock.run}, "):
            return log
        at = log.time + times * (delay + drift * (log.time - clock.at))
        changed, samples = {}, dict(log.samples)
        for name in clock.channels:
            if name in log and (known := np.isfinite(log[name])).any():
                values = np.interp(at, log.time[known], log[name][known])
                changed[name] = np.where(known, values, np.nan)
            if name in samples:
                read, values = samples[name]
                samples[name] = read - times * (delay + drift * (read - clock.at)), values
        return replace(log.with_channels(**changed), samples=samples)

    return moved


def _slope(base: Parameters, inputs: Inputs, effects: Sequence[str], one: _Uncertain) -> Slopes:
    """The change of each parameter by one standard deviation; empty if the shifted logs have no result."""
    up = _published(inputs, effects, one, 1.0)
    if not one.both_ways:
        return {n: e.value - base[n].value for n, e in up.items() if n in base}
    down = _published(inputs, effects, one, -1.0)
    return {n: 0.5 * (e.value - down[n].value) for n, e in up.items() if n in base and n in down}


def _published(inputs: Inputs, effects: Sequence[str], one: _Uncertain, times: float) -> Parameters:
    """The parameters from logs shifted by ``times`` standard deviations, without diagnosis; empty without a result."""
    logs = tuple(one.moved(log, times) for log in inputs.logs)
    known = {e.name: e for e in candidates(inputs.step.situations)}
    taken = [known[n] for n in effects if n in known]
    try:
        problem = inputs.step.prepare(inputs.spec, inputs.data_with(logs), inputs.known)
        result = publish_with(problem, taken)[0] if taken else published(problem)
    except (InputError, ResultError, ArithmeticError):
        return Parameters()
    return Parameters() if result is None or isinstance(result, Failure) else result.parameters


def _widened(published_: Parameters, slopes: Sequence[Slopes]) -> Parameters:
    """The parameters with independent errors added to half widths, standard deviations and correlations."""
    added = {n: np.array([one.get(n, 0.0) for one in slopes]) for n in published_}
    estimates = {n: _wider(e, float(np.linalg.norm(added[n]))) for n, e in published_.items()}
    correlation = {
        a: {b: 1.0 if a == b else _correlation(published_, estimates, added, a, b) for b in row}
        for a, row in published_.correlation.items()
    }
    return replace(published_, estimates=estimates, correlation=correlation)


def _correlation(
    before: Parameters, after: Mapping[str, Estimate], added: Mapping[str, np.ndarray], a: str, b: str
) -> float:
    total = after[a].std * after[b].std
    if not total > 0:
        return before.correlation[a][b]
    return float((before.correlation[a][b] * before[a].std * before[b].std + added[a] @ added[b]) / total)


def _wider(one: Estimate, std: float) -> Estimate:
    low, high = (float(np.hypot(end - one.value, NORMAL95 * std)) for end in one.interval95)
    return replace(one, std=float(np.hypot(one.std, std)), interval95=(one.value - low, one.value + high))
