"""Publishes each answer that a verdict leaves open, and widens the intervals to include them all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from vdyn_cli.diagnosis.candidate_models import CandidateModel
from vdyn_cli.diagnosis.extension import Extension, publish_with
from vdyn_cli.diagnosis.full_model import FittedModel
from vdyn_cli.diagnosis.interval_union import OpenAnswer, biases, widened
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.learned_law import Learned
from vdyn_cli.diagnosis.probable_answers import probable_answers
from vdyn_cli.diagnosis.strategy import Strategy
from vdyn_cli.diagnosis.unexplained import unexplained_biases
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import SimulatedProblem
from vdyn_cli.steps.interval_text import with_wider_intervals

BASELINE = "baseline"
NO_RESULTS: Mapping[tuple[str, ...], Result] = MappingProxyType({})
HOLD_ALL = "The intervals include every answer that the diagnosis leaves open."
HOLD_REMAINDER = "The intervals include the bias by the unexplained residual."


def with_open_answers(
    strategy: Strategy, judgment: Judgment, extension: Extension, problem: SimulatedProblem, base: Result
) -> Result:
    """The result with intervals widened by the verdict.

    * ``adequate``: the mixture of the baseline with answers of one effect.
    * ``named``: the mixture with answers of one more effect. With a significant residual: the bias by that residual,
      and every probable answer of one more effect.
    * ``ambiguous``: all answers, and the baseline if it has a result and is not excluded.
    * ``unknown``: the baseline and the closest model, each with the bias by its unexplained residual.
    * An answer that is not in the model (a learned law, unless requested): that answer and the baseline. A learned law
      in the model because the logs contradict the baseline: both, too. The baseline then has the bias by its whole
      unexplained residual, since its parameters may have absorbed an unknown share of the missing law.

    Parameters
    ----------
    extension : its result is widened, else that of the baseline, ``base``. problem : publishes the other answers.
    """
    result = extension.result or base
    if extension.open and not result.parameters:
        return _beside_others(result, list(extension.answers.values())[1:])
    if not result.parameters or judgment.verdict == "not_testable":
        return result
    if judgment.verdict == "adequate":
        plain = extension.result is None and judgment.note is None
        return _averaged(strategy, judgment.base, problem, result) if plain else result
    found: list[OpenAnswer] = []
    others: list[Result] = []
    answer, note = judgment.answer, HOLD_ALL
    if judgment.verdict == "ambiguous" or extension.open:
        answers = judgment.answers or tuple(filter(None, [judgment.beyond_range]))
        found, others = _published(strategy, answers, problem, result, known=extension.answers)
        if not extension.open:
            found = [OpenAnswer(BASELINE, base.parameters), *found]
    elif judgment.verdict == "unknown" or (answer and not set(answer.effects) <= set(extension.effects)):
        closest = [c for c in (answer or judgment.closest,) if c is not None]
        learned = answer is not None and bool(set(answer.effects) & strategy.model.setup.learned)
        explained = answer is not None and not learned and (answer.sufficient or answer.nearly_sufficient)
        known = {} if explained else _biases(strategy, judgment.base, base, problem)
        found, others = _published(strategy, closest, problem, base, not explained)
        found = [OpenAnswer(BASELINE, base.parameters, known), *found]
    elif base.contradicted and set(extension.effects) & strategy.model.setup.learned:
        found = [OpenAnswer(BASELINE, base.parameters, _biases(strategy, judgment.base, base, problem))]
    elif answer is not None and answer.sufficient:
        return _averaged(strategy, answer.fitted, problem, result)
    elif answer is not None:
        near = strategy.relinearized(answer.fitted)
        more, others = _published(strategy, [one for one, _ in probable_answers(strategy, near)], problem, result)
        found = [OpenAnswer(_label(answer), result.parameters, _biases(strategy, near, result, problem)), *more]
        note = HOLD_REMAINDER
    if others:
        result = problem.spanning(result, others if base.refused or extension.open else (base, *others))
    return with_wider_intervals(result, widened(result.parameters, found), note)


def _beside_others(result: Result, others: Sequence[Result]) -> Result:
    """The prediction by one of several answers, with a note on how well the others predict."""
    if not others:
        return result
    rms = sorted(one.fit.rms for one in others)
    errors = f"{rms[0]:.3g}" if len(rms) == 1 else f"{rms[0]:.3g} to {rms[-1]:.3g}"
    which = "the other answer" if len(rms) == 1 else f"each of the {len(rms)} other answers"
    what = f"with {which} instead, the simulation is off by {errors} {result.fit.unit} rms ({result.fit.rms:.3g} now)"
    return replace(result, findings=(*result.findings, Finding("diagnosis", what, minor=True)))


def holding_free_curve(result: Result, extension: Extension, law: Learned | None, problem: SimulatedProblem) -> Result:
    """The result of a learned formula ``law``, with intervals that include those of the free curve; others unchanged.

    A formula may deviate locally by more than its own interval: for example a sine at the flank of a step.
    """
    if law is None or law.free is None or extension.effects != (law.name,) or not result.parameters:
        return result
    curve = publish_with(problem, [law.free])[0]
    return result if curve is None else problem.spanning(result, [curve])


def _averaged(strategy: Strategy, fitted: FittedModel, problem: SimulatedProblem, result: Result) -> Result:
    """The result of a fit, with the intervals of its mixture with answers of one more effect."""
    probable = probable_answers(strategy, fitted)
    each = [_published(strategy, [one], problem, result) for one, _ in probable]
    found = [replace(one[0][0], probability=p) for one, (_, p) in zip(each, probable, strict=True)]
    others = [(p, one[1][0]) for one, (_, p) in zip(each, probable, strict=True) if one[1]]
    averaged = problem.averaged(result, others) if others else result
    return with_wider_intervals(averaged, widened(averaged.parameters, found))


def _published(
    strategy: Strategy,
    answers: Sequence[CandidateModel],
    problem: SimulatedProblem,
    base: Result,
    unexplained: bool = False,
    known: Mapping[tuple[str, ...], Result] = NO_RESULTS,
) -> tuple[list[OpenAnswer], list[Result]]:
    """The parameters with each answer in the model, and the results of those answers that the step can publish.

    The parameters are those of the diagnosis's fit where the step publishes no result.

    Parameters
    ----------
    known : results of answers that are published already, by the names of their effects.
    """
    found, results, candidates = [], [], strategy.model.setup.candidates
    for answer in answers:
        near = strategy.relinearized(answer.fitted)
        result = known.get(answer.effects)
        if result is None:
            result = publish_with(problem, [candidates[e] for e in answer.effects], near.values)[0]
        bias = _biases(strategy, near, result or base, problem) if unexplained else {}
        found.append(OpenAnswer(_label(answer), result.parameters if result else _by_fit(near, base), bias))
        results += [result] if result else []
    return found, results


def _by_fit(near: FittedModel, base: Result) -> dict[str, Estimate]:
    """The published parameters among the fitted ones, with the values and intervals of a fit of the diagnosis."""
    fit = near.solution
    return {
        n: replace(e, value=float(fit.values[n]), std=float(fit.std[n]), interval95=fit.interval95[n])
        for n, e in base.parameters.items()
        if n in fit.values
    }


def _biases(strategy: Strategy, at: FittedModel, result: Result, problem: SimulatedProblem) -> dict[str, float]:
    """Half the 95 % interval of each published parameter's bias by the unexplained residual of a fit."""
    found = unexplained_biases(strategy.model, at)
    return biases({n: float(v) for n, v in at.values.items()}, found, result.parameters, problem.derived)


def _label(answer: CandidateModel) -> str:
    return " + ".join(answer.effects)
