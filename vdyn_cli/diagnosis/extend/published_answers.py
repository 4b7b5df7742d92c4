"""Results of a step with effects in its model, and which answers of a diagnosis they confirm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name.candidate_judgment import keeping_answers
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel
from vdyn_cli.diagnosis.strategies.effect_unknowns import shapes_of, started_at, unknowns_of
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.effects import Effect
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import Failure, Problem, published
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.contract import NO_VALUES

ZERO = "is not significantly different from zero"
AMPLITUDE = "the amplitude"
EACH = "the amplitude of each confounded effect"
Published = tuple[Result | None, tuple[Finding, ...]]
"""A result with effects in the model, or the findings why there is none."""


def publish_with(
    problem: Problem, effects: Sequence[Effect], start: Mapping[str, float] = NO_VALUES, prior: bool = False
) -> Published:
    """The step's estimate with effects in its model, or findings why there is none.

    Shape parameters are free; if that fails, they stay at their nominal values.

    Parameters
    ----------
    effects : without any, no estimate is made. start : starting values of the effects' unknowns.
    prior : give amplitudes a prior about zero, as wide as their ranges.
    """
    if not effects:
        return None, ()
    failed: tuple[Finding, ...] = ()
    extra = [started_at(u, start) for e in effects for u in unknowns_of(e, prior, holding=start)]
    shapes = {n for e in effects for n in shapes_of(e)}
    for free in (extra, [u for u in extra if u.name not in shapes]) if shapes else (extra,):
        result = published(problem, AddedEffects(tuple(effects), tuple(free)))
        if not isinstance(result, Failure):
            return result, ()
        why = result.findings[0]
        what = f"the model could not be extended by {', '.join(e.name for e in effects)}: {why.reason}"
        failed = (Finding("diagnosis", what, why.got, why.remedy),)
    return None, failed


def published_answer(strategy: Strategy, answer: CandidateModel, problem: Problem) -> Published:
    """What the step publishes with an answer in its model, from the values of the diagnosis's fit."""
    effects = [strategy.model.setup.candidates[e] for e in answer.effects]
    return publish_with(problem, effects, strategy.relinearized(answer.fitted).values)


def holding_zero(
    amplitudes: Mapping[str, Estimate], setup: DiagnosisSetup, effects: Sequence[str], confirmed: bool
) -> str:
    """The first effect with one amplitude whose interval contains zero, in words; empty where there is none.

    ``confirmed``: held-out runs are predicted significantly better; effects with a shape parameter then pass.
    """
    for effect in (setup.candidates[e] for e in effects):
        (first, *others) = effect.unknowns
        if first in amplitudes and (not others or (not confirmed and set(others) == set(shapes_of(effect)))):
            low, high = amplitudes[first].interval95
            if low <= 0.0 <= high:
                return effect.label if len(effects) > 1 else AMPLITUDE
    return ""


def published_amplitudes(result: Result, effects: Sequence[Effect]) -> dict[str, Estimate]:
    """Amplitudes of the effects by the fit of the extended model."""
    found = result.amplitudes
    return {
        n: replace(found[n], unit=q.unit, meaning=q.meaning, source=effect.name)
        for effect in effects
        for n, q in effect.unknowns.items()
        if n in found
    }


def without_zero_answers(
    strategy: Strategy, judgment: Judgment, problem: Problem
) -> tuple[Judgment, dict[tuple[str, ...], Published]]:
    """The judgment without the answers whose effect has no amplitude in the step's own fit.

    That fit has exact laws, or a form of the main law that is free: an effect may stand for an error that it does not
    have. With a free shape, the amplitude is uncertain even if the effect is certain: such an effect is dropped only
    with all others. Answers of several effects, and those that the step cannot fit, stay.

    Returns
    -------
    The judgment, and what the step publishes with each answer, by the names of its effects.
    """
    setup = strategy.model.setup
    if any(len(a.effects) > 1 or set(a.effects) & setup.learned for a in judgment.answers):
        return judgment, {}
    confirmed = judgment.gain is not None and judgment.gain.better
    found = {a.effects: published_answer(strategy, a, problem) for a in judgment.answers}

    def zero(effects: tuple[str, ...], shaped: bool) -> bool:
        result = found[effects][0]
        if result is None:
            return False
        amplitudes = published_amplitudes(result, [setup.candidates[e] for e in effects])
        return bool(holding_zero(amplitudes, setup, effects, not shaped))

    if found and all(zero(effects, not confirmed) for effects in found):
        return judgment.refuted(f"{EACH if len(found) > 1 else AMPLITUDE} {ZERO}"), found
    kept = tuple(a for a in judgment.answers if not zero(a.effects, False))
    return keeping_answers(strategy, judgment, kept), found
