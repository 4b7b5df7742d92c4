"""Widens intervals to include every answer that the data leave open, and the bias by its unexplained residual.

    low = min over answers of (low_a - w_a),     w_a = sqrt(half_a^2 + bias_a^2) - half_a

with [low_a, high_a] the interval that the step publishes with the answer in its model, half_a half of it, and bias_a
half the 95 % interval of the bias by the answer's unexplained residual (``unexplained``). The value stays.

Answers with a probability are weighted by it: the interval is that of the mixture (``mixture_interval``).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from vdyn_cli.diagnosis.detect.unexplained import Bias, half_widths
from vdyn_cli.inference.mixture import mixture_interval
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.parameters import UNEXPLAINED, Estimate, Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.quantities.vocabulary import PARAMETERS

GROWN = 1.02  # least growth of the half width; less is invisible in the two published digits
FIXED = 1e-6  # share of the widest interval, in place of the width zero of a value that the published model fixes
DERIVATIVE_STEP = 0.1  # share of a bias or half interval, the step over which derived parameters are differentiated


@dataclass(frozen=True)
class OpenAnswer:
    """One answer that the data leave open.

    Parameters
    ----------
    label : the effects' names, joined by " + "; or "baseline".
    parameters : as the step publishes them with the effects in its model.
    bias : half the 95 % interval of the bias of each parameter by the answer's unexplained residual.
    probability : of this answer against the published one; None: included whatever its probability.
    result : that the step publishes with it; None where it publishes none, and for the baseline.
    """

    label: str
    parameters: Mapping[str, Estimate]
    bias: Mapping[str, float] = field(default_factory=dict)
    probability: float | None = None
    result: Result | None = None


def widened(published: Parameters, answers: Sequence[OpenAnswer]) -> Parameters:
    """The published parameters with intervals that include those of all answers; ``spans`` lists what widened them.

    A parameter that is given in every answer is not changed; one that only the published model fixes, such as a
    coefficient that is zero in it, is. ``std`` grows in proportion to the longer side of the interval.
    """
    return replace(published, estimates={n: _widened(n, e, answers) for n, e in published.items()})


def _widened(name: str, one: Estimate, answers: Sequence[OpenAnswer]) -> Estimate:
    low, high = one.interval95
    known = [a for a in answers if name in a.parameters]
    estimated = [e.source for a in known if (e := a.parameters[name]).source != "given" and e.half_width > 0]
    if (not high > low or one.source == "given") and not estimated:
        return one
    spans: list[str] = []
    half = 0.5 * (high - low)
    probable = [(a.probability, a.parameters[name].interval95) for a in known if a.probability]
    ends = [low, high, *mixture_ends((low, high), probable)]
    for answer in known:
        bias, (a, b) = answer.bias.get(name, 0.0), answer.parameters[name].interval95
        more = float(np.hypot(0.5 * (b - a), bias)) - 0.5 * (b - a)
        if a < low or b > high:
            spans.append(answer.label)
        if more > (GROWN - 1.0) * half:
            spans.append(UNEXPLAINED)
        if answer.probability is None:
            ends += [a - more, b + more]
    begin, end = _possible(name, one, min(ends), max(ends))
    if end - begin <= GROWN * (high - low):
        return one
    reach = max(end - one.value, one.value - begin)
    std = max(one.std * reach / half if one.std > 0 else reach / NORMAL95, one.std)
    source = estimated[0] if one.source == "given" else one.source
    return replace(one, interval95=(begin, end), std=std, source=source, spans=tuple(dict.fromkeys(spans)))


def mixture_ends(own: tuple[float, float], others: Sequence[tuple[float, tuple[float, float]]]) -> tuple[float, ...]:
    """The interval of the mixture of an estimate and others with their probabilities; empty without any."""
    wide = [(p, (low, high)) for p, (low, high) in others if high > low]
    if not wide:
        return ()
    low, high = own
    least = 0.0 if high > low else FIXED * max(b - a for _, (a, b) in wide)
    return mixture_interval((low - least, high + least), wide)


def _possible(name: str, one: Estimate, low: float, high: float) -> tuple[float, float]:
    """The interval limited to the physical range of the parameter, but at least the published interval."""
    known = PARAMETERS.get(name)
    if known is None:
        return low, high
    return max(low, min(known.lower, one.interval95[0])), min(high, max(known.upper, one.interval95[1]))


def biases(
    fitted: Mapping[str, float],
    found: Sequence[Bias],
    published: Mapping[str, Estimate],
    derived: Callable[[Mapping[str, float]], Mapping[str, float]],
) -> dict[str, float]:
    """Half the 95 % interval of the bias of every published parameter, from the biases of the fitted ones.

    Parameters
    ----------
    fitted : values of the fitted unknowns. found : their biases, one for each profile; the largest is used.
    derived : values of the unknowns -> published parameters derived from them, to first order.

    Notes
    -----
    A published parameter that is neither fitted nor derived gets the largest ratio of bias to interval of the others.
    """
    if not found:
        return {}
    every = [{**one, **_derived(fitted, one, derived)} for one in found]
    known = {n: bias for n, bias in half_widths(every).items() if n in published}
    ratio = max((b / published[n].half_width for n, b in known.items() if published[n].half_width > 0), default=0.0)
    return known | {n: ratio * e.half_width for n, e in published.items() if n not in known}


def propagated(
    found: Mapping[str, Estimate],
    correlation: Mapping[str, Mapping[str, float]],
    derived: Callable[[Mapping[str, float]], Mapping[str, float]],
    others: Mapping[str, float] = MappingProxyType({}),
) -> dict[str, float]:
    """Half the 95 % interval of each derived parameter, from those of the fitted ones, to first order.

    half^2 = sum_ij s_i s_j R_ij,   s_i = derivative by parameter i times half its interval

    Parameters
    ----------
    correlation : R, by name; pairs that it lacks are not correlated. others : values of further unknowns.
    """
    at = {**others, **{n: e.value for n, e in found.items()}}
    halves = {n: e.half_width for n, e in found.items() if e.half_width > 0}
    slopes = _slopes(derived, at, halves)
    matrix = np.array([[correlation.get(a, {}).get(b, float(a == b)) for b in halves] for a in halves])
    parts = {m: np.array([halves[n] * slopes[n][m] for n in halves]) for m in derived(at)}
    return {m: float(np.sqrt(max(v @ matrix @ v, 0.0))) if halves else 0.0 for m, v in parts.items()}


def _derived(
    fitted: Mapping[str, float], bias: Bias, derived: Callable[[Mapping[str, float]], Mapping[str, float]]
) -> Bias:
    """The bias of derived parameters: the sum over fitted ones of slope times bias."""
    sizes = {n: float(np.linalg.norm(parts)) for n, parts in bias.items() if n in fitted and np.any(parts)}
    slopes, none = _slopes(derived, fitted, sizes), np.zeros(len(next(iter(bias.values()))))
    return {m: np.sum([none, *(slopes[n][m] * bias[n] for n in sizes)], axis=0) for m in derived(fitted)}


def _slopes(
    derived: Callable[[Mapping[str, float]], Mapping[str, float]], at: Mapping[str, float], sizes: Mapping[str, float]
) -> dict[str, dict[str, float]]:
    """Derivatives of derived parameters by each unknown of ``sizes``, over ``DERIVATIVE_STEP`` of its size."""
    base, steps = derived(at), {n: DERIVATIVE_STEP * size for n, size in sizes.items()}
    moved = {n: derived({**at, n: at[n] + step}) for n, step in steps.items()}
    return {n: {m: (moved[n][m] - base[m]) / step for m in base} for n, step in steps.items()}
