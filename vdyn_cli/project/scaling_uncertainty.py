"""The uncertainty of the constants by which a channel was made from another one, in the published intervals.

A channel that is a scale times another one has the relative error of the scale in all its samples of all runs, so that
no scatter of the data shows it. The step is published once more with the channel scaled by one standard deviation::

    slope = p(channel (1 + s)) - p(channel),     std' = sqrt(std^2 + slope^2)

with p the parameters, with the effects that extended the model in it, and s the relative standard deviation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.diagnosis.extension import publish_with
from vdyn_cli.effects import candidates
from vdyn_cli.project.channel_sources import Scaling
from vdyn_cli.project.inputs import Inputs
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.errors import Finding, InputError, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import Failure, published
from vdyn_cli.steps.interval_text import with_wider_intervals

Slopes = Mapping[str, float]
SHOWN = 1.02  # of a half width: below, two digits of an interval do not show that it is wider


def with_scaling_uncertainty(result: Result, inputs: Inputs) -> Result:
    """The result whose intervals hold the uncertainty of the constants behind its channels.

    Parameters
    ----------
    result : diagnosed, and of the extended model where there is one.
    """
    uncertain = [s for s in inputs.scalings if s.relative_std > 0 and _is_read(s, inputs.logs)]
    if not uncertain or result.refused:
        return result
    effects = result.diagnosis.extended if result.diagnosis else ()
    slopes, left_out = [], []
    for one in uncertain:
        moved = _moved(inputs, effects, one) if result.parameters else {}
        found = {n: e.value - result.parameters[n].value for n, e in moved.items() if n in result.parameters}
        if found:
            slopes.append(found)
        else:
            left_out.append(_not_contained(one))
    if not slopes:
        return replace(result, findings=(*result.findings, *left_out))
    parameters = _widened(result.parameters, slopes)
    grown = {n: e for n, e in parameters.items() if _half(e) > SHOWN * _half(result.parameters[n])}
    why = " and ".join(c for one in uncertain for c, e in one.constants.items() if e.std > 0)
    sentence = with_wider_intervals(result.sentence, grown, f"with the uncertainty of {why}")
    return replace(result, parameters=parameters, sentence=sentence, findings=(*result.findings, *left_out))


def _is_read(scaling: Scaling, logs: Sequence[Log]) -> bool:
    return any(scaling.channel.source in log for log in logs)


def _moved(inputs: Inputs, effects: Sequence[str], scaling: Scaling) -> Parameters:
    """The parameters with the channel one standard deviation larger, without a diagnosis; none where none are given."""
    name, factor = scaling.channel.target, 1.0 + scaling.relative_std
    logs = tuple(log.with_channels(**{name: factor * log[name]}) if name in log else log for log in inputs.logs)
    known = {e.name: e for e in candidates(inputs.step.situations)}
    taken = [known[n] for n in effects if n in known]
    try:
        problem = inputs.step.prepare(inputs.spec, inputs.data_with(logs), inputs.known)
        result = publish_with(problem, taken)[0] if taken else published(problem)
    except (InputError, ResultError, ArithmeticError):
        return Parameters()
    return Parameters() if result is None or isinstance(result, Failure) else result.parameters


def _not_contained(scaling: Scaling) -> Finding:
    names = " and ".join(n for n, e in scaling.constants.items() if e.std > 0)
    what = f"the intervals do not contain the uncertainty of {names} ({scaling.relative_std:.2g} of the channel)"
    return Finding(scaling.channel.target, what, doubt=True)


def _half(one: Estimate) -> float:
    return 0.5 * (one.interval95[1] - one.interval95[0])


def _widened(published_: Parameters, slopes: Sequence[Slopes]) -> Parameters:
    """The parameters with independent errors added: half widths, standard deviations and correlations."""
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
