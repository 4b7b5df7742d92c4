"""Extends the step's model by effects: repeats its estimate, with their amplitudes and the bias without them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.extend.amplitudes import fitted_amplitudes
from vdyn_cli.diagnosis.extend.published_answers import (
    EACH,
    ZERO,
    Published,
    holding_zero,
    publish_with,
    published_amplitudes,
    published_answer,
    without_zero_answers,
)
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name.candidate_judgment import with_fewer_effects, without_answer
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.size.finding_size import Limits
from vdyn_cli.diagnosis.size.published_size import size_by_results
from vdyn_cli.diagnosis.strategies.effect_unknowns import amplitudes_of, largest_plausible
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.effects import Effect
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import Problem
from vdyn_cli.steps.contract import NO_VALUES
from vdyn_cli.steps.effect_estimates import is_law

STILL_MISSED = "the simulation with it still misses the logs"


@dataclass(frozen=True)
class Extension:
    """The effects by which the model was extended, and the outcome.

    Parameters
    ----------
    effects : their names; empty if nothing was requested or the extension failed.
    result : of the step with the extended model.
    amplitudes : by unknown of the effects, from that model's fit; if they are one of several answers of one effect,
        also those of the others, each from its own fit.
    biased : by effect and published parameter, the value without that effect minus the value with it.
    failed : why the model could not be extended.
    open : whether the effects are one of several answers, used because the baseline has no result or is excluded.
    answers : by the names of their effects, the results of all of several answers; if ``open``, that of ``effects``
        first.
    """

    effects: tuple[str, ...] = ()
    result: Result | None = None
    amplitudes: Mapping[str, Estimate] = field(default_factory=dict)
    biased: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    failed: tuple[Finding, ...] = ()
    open: bool = False
    answers: Mapping[tuple[str, ...], Result] = field(default_factory=dict)

    @property
    def labels_end(self) -> str:
        """The end of the list of labels in a sentence, which states that they are one of several answers."""
        return f", one of {len(self.answers)} answers" if self.open and len(self.answers) > 1 else ""


def extended(
    strategy: Strategy, judgment: Judgment, extend: str | list[str], problem: Problem, base: Result
) -> tuple[Judgment, Extension]:
    """The extension by the answer or the requested effects, and the judgment with what the exact model shows.

    * An effect that may be zero in the extended model is not named, nor is it one of several answers.
    * An answer of several effects that the exact model does not confirm is replaced by fewer that nearly suffice.
    * If neither the baseline nor the answer gives a result, the answer is replaced by the other effects that suffice.
    * If the baseline gives no result or is excluded, the one of several answers whose result has the fewest doubts is
      used, the first of equal ones.
    * If the baseline misses the logs, an answer with which the model misses them, too, is dropped.

    Parameters
    ----------
    extend : ``diagnose.extend`` of the description: never, named, learned, or a list of effects.
    problem : publishes the result with effects in its model.
    base : the baseline's result.
    """
    known = dict[tuple[str, ...], Published]()
    if len(judgment.answers) > 1 and (base.parameters or base.refused):  # which publish each of several answers
        judgment, known = without_zero_answers(strategy, judgment, problem)
    judgment, extension = _extended(strategy, judgment, extend, problem, base, known)
    if not extension.open:
        extension = replace(extension, answers={n: one for n, (one, _) in known.items() if one is not None})
    found = judgment, extension
    if extend not in ("named", "learned"):
        return found
    others = (with_fewer_effects, without_answer) if base.refused else (with_fewer_effects,)
    for other in others:
        if found[1].result is not None or found[0].answer is None:
            break
        fewer = other(strategy, judgment)
        again = _extended(strategy, fewer, extend, problem, base, known) if fewer else found
        if again[1].result is not None:
            found = again
    judgment, extension = found
    if extension.result is None and judgment.answer is not None and _missed(base):
        judgment = judgment.refuted(STILL_MISSED)
    return judgment, extension


def _extended(
    strategy: Strategy,
    judgment: Judgment,
    extend: str | list[str],
    problem: Problem,
    base: Result,
    known: Mapping[tuple[str, ...], Published],
) -> tuple[Judgment, Extension]:
    setup = strategy.model.setup
    if extend in ("named", "learned") and _without_baseline(strategy, judgment, base):
        found = _with_open_answer(strategy, judgment, extend == "learned", problem, _missed(base), known)
        if judgment.beyond_range is None or base.refused or _less_doubtful(found[1].result, base):
            return found
        within = min(judgment.tried, key=lambda t: t.cost, default=None)
        return judgment.refuted(closest=within), Extension()
    wanted = _wanted(extend, setup, judgment, base)
    start = strategy.relinearized(judgment.answer.fitted).values if judgment.answer else NO_VALUES
    effects = [setup.candidates[e] for e in wanted]
    result, failed = publish_with(problem, effects, start)
    if result is not None and _beyond_plausible(result, [e for e in effects if e.name not in setup.learned]):
        result = publish_with(problem, effects, start, prior=True)[0] or result
    if isinstance(extend, list):  # the user must learn that the requested effect is not in the model
        failed = tuple(replace(f, doubt=True) for f in failed)
    if zero := _may_be_zero(judgment, setup, wanted, result):
        judgment = judgment.refuted(f"{zero} {ZERO}")
        if extend in ("named", "learned"):
            result = None
    if result is None:
        return judgment, Extension(failed=failed)
    amplitudes = published_amplitudes(result, effects)
    return judgment, Extension(wanted, result, amplitudes, _biased(problem, base, result, wanted, setup), failed)


def _beyond_plausible(result: Result, effects: Sequence[Effect]) -> bool:
    """Whether the amplitude of an effect is beyond its plausible range, and the effect has no wider possible one.

    Such an amplitude is nearly collinear with a parameter, as that of a brake that releases slowly with the drag area.
    The data then determine only their sum, and the prior decides where on that line the answer lies.
    """
    found = [(effect, n) for effect in effects for n in amplitudes_of(effect) if n not in effect.possible]
    values = result.amplitudes
    return any(n in values and abs(values[n].value) > largest_plausible(effect, n) for effect, n in found)


def _with_open_answer(
    strategy: Strategy,
    judgment: Judgment,
    learned: bool,
    problem: Problem,
    missed: bool,
    known: Mapping[tuple[str, ...], Published],
) -> tuple[Judgment, Extension]:
    """The model extended by the first of several answers with which it gives a result with the fewest doubts.

    Answers without a result are skipped. With a prediction, a note gives the errors of the other answers.

    Parameters
    ----------
    missed : whether the baseline misses the logs; if all answers miss them, too, none is accepted.
    known : what the step publishes with answers, as far as it is known.
    """
    setup = strategy.model.setup
    if zero := _may_be_zero(judgment, setup, (), None):
        return judgment.refuted(f"{zero} {ZERO}"), Extension()
    failed, results = tuple[Finding, ...](), dict[tuple[str, ...], Result]()
    alone = all(len(answer.effects) == 1 for answer in judgment.possible)
    tried = [a for a in judgment.possible if learned or not set(a.effects) & setup.learned]
    for answer in tried:
        result, failed = known.get(answer.effects) or published_answer(strategy, answer, problem)
        if result is not None:
            results[answer.effects] = result
    if missed and tried and not results:
        judgment = judgment.refuted(STILL_MISSED, judgment.beyond_range)
    if not results:
        return judgment, Extension(failed=failed)
    answers = dict(sorted(results.items(), key=lambda one: len(one[1].doubts)))
    first, *others = answers
    amplitudes = dict[str, Estimate]()
    for names in (first, *(others if alone else ())):  # linear fits about a refused baseline give wrong amplitudes
        amplitudes |= published_amplitudes(answers[names], [setup.candidates[e] for e in names])
    return judgment, Extension(first, answers[first], amplitudes, open=True, answers=answers)


def _less_doubtful(result: Result | None, base: Result) -> bool:
    """Whether a result with an effect beyond its plausible range replaces the baseline's: it must remove a doubt.

    Such an effect can imitate another law, as a fading brake does the air drag: the parameters are then physically
    wrong, and the noise estimate absorbs the residual. A result without any doubt also replaces a baseline that a
    simple evaluation of the logs contradicts.
    """
    if result is None:
        return False
    warnings = len(result.fit.warnings)
    return warnings < len(base.fit.warnings) or (base.contradicted and not (warnings or result.contradicted))


def _missed(base: Result) -> bool:
    """Whether the baseline has no result because its simulation misses the logs."""
    return any(f.doubt for f in base.refused)


def _without_baseline(strategy: Strategy, judgment: Judgment, base: Result) -> bool:
    """Whether one of several answers, or an effect beyond its plausible range, replaces the baseline.

    It does if the baseline has no result. It also does if the data exclude the baseline: the logs contradict it (effect
    beyond its range), or every answer has an amplitude far from zero.
    """
    if judgment.beyond_range is not None:
        return bool(base.refused) or base.contradicted
    if judgment.verdict != "ambiguous" or not (base.refused or base.parameters):
        return False
    return bool(base.refused) or all(_far_from_zero(strategy, answer) for answer in judgment.answers)


def _far_from_zero(strategy: Strategy, answer: CandidateModel) -> bool:
    near = replace(answer, fitted=strategy.relinearized(answer.fitted))
    return _excludes(fitted_amplitudes(near, strategy.model.setup))


def _excludes(amplitudes: Mapping[str, Estimate]) -> bool:
    """Whether one of the amplitudes is so far from zero that the data exclude the baseline."""
    return any(abs(e.value) > POLICY.excluding_amplitude * e.std > 0 for e in amplitudes.values())


def without_idle_answer(judgment: Judgment, extension: Extension, base: Result, limits: Limits) -> Judgment | None:
    """The judgment whose finding does not matter by the exact model; None where it does, or may.

    The diagnosis's fits lack what the step adds to its noise model, such as a road that all runs share: that may
    already hold what a weak effect explains. An amplitude that excludes the baseline is certain beside it, too.
    """
    answer, last = judgment.answer, extension.result
    if answer is None or last is None or judgment.size is None or set(answer.effects) != set(extension.effects):
        return None
    size = size_by_results(judgment.size, base, last)
    if size is None or limits.exceeded(size) or _excludes(extension.amplitudes):
        return None
    return replace(judgment, size=size, material=False, gain=None)


def _wanted(extend: str | list[str], setup: DiagnosisSetup, judgment: Judgment, base: Result) -> tuple[str, ...]:
    """The effects by which to extend the model: the requested or the named ones.

    A learned law is used without a request if the baseline has no result or a simple evaluation of the logs contradicts
    it. A formula is used also if it is sufficient and its amplitude excludes the baseline, or if the residuals are far
    above the noise floor: a table, whose course includes that of the part's own law, leaves the parameters of that law
    undetermined.
    """
    if isinstance(extend, list):
        return tuple(n for n in setup.candidates if n in extend)
    answer = judgment.answer
    if answer is None or extend not in ("named", "learned"):
        return ()
    learned = [setup.candidates[n] for n in setup.learned.intersection(answer.effects)]
    if not learned or extend == "learned" or base.refused or base.contradicted:
        return answer.effects
    sizes = {n: e for n, e in fitted_amplitudes(answer, setup).items() if any(n in amplitudes_of(x) for x in learned)}
    formula = (answer.sufficient and _excludes(sizes)) or base.fit.misfit
    return answer.effects if formula and all(map(is_law, learned)) else ()


def _may_be_zero(judgment: Judgment, setup: DiagnosisSetup, effects: Sequence[str], result: Result | None) -> str:
    """The named effect that is not significantly different from zero, in words; empty where there is none.

    By ``result`` if that is extended by exactly the named effects, else by the diagnosis's fit.
    """
    if not judgment.answers:
        return ""
    # With a free shape, the amplitude is uncertain even if the effect is certain; held-out runs then decide.
    confirmed = judgment.gain is not None and judgment.gain.better
    if judgment.answer is None:
        each = (
            len(a.effects) == 1 and holding_zero(fitted_amplitudes(a, setup), setup, a.effects, confirmed)
            for a in judgment.answers
        )
        return EACH if all(each) else ""
    named = judgment.answer.effects
    if result is not None and set(effects) == set(named):
        return holding_zero(published_amplitudes(result, [setup.candidates[e] for e in named]), setup, named, confirmed)
    return holding_zero(fitted_amplitudes(judgment.answer, setup), setup, named, confirmed)


def _biased(
    problem: Problem, base: Result, result: Result, effects: Sequence[str], setup: DiagnosisSetup
) -> dict[str, dict[str, float]]:
    """The bias of the parameters without each effect, with the others in the model."""
    found = {}
    for effect in effects:
        others = [setup.candidates[e] for e in effects if e != effect]
        without = publish_with(problem, others)[0] if others and result.parameters else base
        found[effect] = {} if without is None else _difference(without, result)
    return found


def _difference(before: Result, after: Result) -> dict[str, float]:
    return {
        n: before.parameters[n].value - e.value
        for n, e in after.parameters.items()
        if n in before.parameters and before.parameters[n].value != e.value
    }
