"""Amplitudes of effects as estimates with interval, unit and meaning."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.diagnosis.detect.unexplained import half_widths, unexplained_biases
from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.extend.interval_union import mixture_ends
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel
from vdyn_cli.diagnosis.name.probable_answers import probable_answers
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.quantities.parameters import Estimate


def fitted_amplitudes(answer: CandidateModel, setup: DiagnosisSetup) -> dict[str, Estimate]:
    """The unknowns of a candidate model's effects, as the diagnosis fitted them.

    Returns
    -------
    Estimates by name of the unknown, each in the unit of that unknown; the effect is the source.
    """
    solution, found = answer.fitted.solution, {}
    for effect in (setup.candidates[e] for e in answer.effects):
        for n, q in effect.unknowns.items():
            if n in solution.values:
                value, std, ends = solution.values[n], solution.std[n], solution.interval95[n]
                found[n] = Estimate(value, std, ends, q.unit, q.meaning, effect.name)
    return found


def open_amplitudes(strategy: Strategy, judgment: Judgment, amplitudes: Mapping[str, Estimate]) -> dict[str, Estimate]:
    """The amplitudes of a named answer with intervals widened as those of the published parameters.

    If the answer leaves no significant residual, the intervals are those of its mixture with answers of one more
    effect, each about its own amplitudes: a linear fit may give a large delay several times too large. Else they
    include the bias by that residual, half' = sqrt(half^2 + bias^2).
    """
    answer = judgment.answer
    if judgment.verdict != "named" or answer is None or not amplitudes:
        return dict(amplitudes)
    if answer.sufficient:
        probable = [
            (p, replace(a, fitted=strategy.relinearized(a.fitted)))
            for a, p in probable_answers(strategy, answer.fitted)
        ]
        each = [(p, fitted_amplitudes(one, strategy.model.setup)) for p, one in probable]
        return {n: _mixed(e, [(p, o[n].interval95) for p, o in each if n in o]) for n, e in amplitudes.items()}
    bias = half_widths(unexplained_biases(strategy.model, answer.fitted))  # a relinearized fit has no profiles
    return {n: _wider(e, float(np.hypot(e.half_width, bias.get(n, 0.0)))) for n, e in amplitudes.items()}


def _mixed(one: Estimate, others: Sequence[tuple[float, tuple[float, float]]]) -> Estimate:
    """The estimate with the interval of its mixture with others, if that is wider; its value stays."""
    ends = mixture_ends(one.interval95, others)
    if not ends or one.half_width <= 0.0:
        return one
    low, high = min(one.interval95[0], *ends), max(one.interval95[1], *ends)
    reach = max(high - one.value, one.value - low)
    return replace(one, std=one.std * max(reach / one.half_width, 1.0), interval95=(low, high))


def _wider(one: Estimate, half: float) -> Estimate:
    """The estimate widened to this half width, with its standard deviation increased in proportion."""
    more, low, high = half - one.half_width, *one.interval95
    std = one.std * half / one.half_width if one.half_width > 0.0 else one.std
    return replace(one, std=std, interval95=(low - more, high + more)) if more > 0.0 else one
