"""Publishes each answer that a verdict leaves open, and widens the intervals to include them all."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from vdyn_cli.diagnosis.detect.unexplained import unexplained_biases
from vdyn_cli.diagnosis.extend.extension import Extension
from vdyn_cli.diagnosis.extend.interval_union import OpenAnswer, biases, propagated, widened
from vdyn_cli.diagnosis.extend.other_laws import in_other_forms
from vdyn_cli.diagnosis.extend.published_answers import publish_with
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel
from vdyn_cli.diagnosis.name.probable_answers import probable_answers
from vdyn_cli.diagnosis.strategies.full_model import FittedModel
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.effects import Effect
from vdyn_cli.inference import Solution
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import BASELINE, Estimate
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import SimulatedProblem
from vdyn_cli.steps.wider_intervals import with_wider_intervals

NO_RESULTS: Mapping[tuple[str, ...], Result] = MappingProxyType({})
HOLD_ALL = "The intervals include every answer that the diagnosis leaves open."
HOLD_REMAINDER = "The intervals include the bias by the unexplained residual."
CERTAIN = 1.0 - 1e-9  # largest probability, of which odds are computed


def with_open_answers(
    strategy: Strategy, judgment: Judgment, extension: Extension, problem: SimulatedProblem, base: Result
) -> Result:
    """The result with intervals widened by the verdict.

    * ``not_testable``: the answers that are confounded in runs of one direction, and the baseline.
    * ``adequate``: the mixture of the baseline with answers of one effect, also by another form of its law.
    * ``ambiguous``: all answers except the doubtful, and the baseline if it has a result and is not excluded.
    * ``unknown``: the baseline and the closest model, each with the bias by its unexplained residual.
    * An answer that is not in the model (a learned law, unless requested): that answer and the baseline. A learned law
      in the model because the logs contradict the baseline: both, too. The baseline then has the bias by its whole
      unexplained residual, since its parameters may have absorbed an unknown share of the missing law.
    * ``named``: the mixture with answers of one more effect. With a significant residual: the bias by that residual,
      and every probable answer of one more effect.

    Parameters
    ----------
    extension : its result is widened, else that of the baseline, ``base``. problem : publishes the other answers.
    """
    result, answer, learned = extension.result or base, judgment.answer, strategy.model.setup.learned
    if not result.parameters:
        return _beside_others(result, list(extension.answers.values())[1:]) if extension.open else result
    widening = _Widening(strategy, problem, base, result)
    if judgment.verdict == "not_testable":
        found = widening.published(judgment.confounded)
        return widening.including([widening.baseline(), *found]) if found else result
    if judgment.verdict == "adequate":
        decided = extension.result is not None or judgment.immaterial is not None
        return result if decided else widening.averaged(judgment.base, widening.in_other_forms())
    if judgment.verdict == "ambiguous" or extension.open:
        found, notes = least_doubtful(widening.published(judgment.possible, known=extension.answers))
        whole = widening.including(found if extension.open else [widening.baseline(), *found])
        return replace(whole, findings=(*whole.findings, *notes))
    if judgment.verdict == "unknown" or (answer and not set(answer.effects) <= set(extension.effects)):
        law = answer if answer and not set(answer.effects) & learned else None
        explained = law is not None and (law.sufficient or law.nearly_sufficient)
        found = widening.published(filter(None, [answer or judgment.closest]), not explained)
        at = None if explained else judgment.base
        # A learned law shows which element is at fault; an error of others would bias other parameters.
        elements = {on for e in answer.effects for on in strategy.model.setup.candidates[e].on} if answer else ()
        return widening.including([widening.baseline(at, elements), *found])
    if base.contradicted and set(extension.effects) & learned:
        return widening.including([widening.baseline(judgment.base)])
    if answer is None:  # a sensor did not measure
        return widening.including([])
    if answer.sufficient:
        return widening.averaged(answer.fitted)
    near = strategy.relinearized(answer.fitted)
    more = widening.published(one for one, _ in probable_answers(strategy, near))
    own = OpenAnswer(_label(answer), result.parameters, widening.biases(near, result))
    return widening.including([own, *more], HOLD_REMAINDER)


@dataclass(frozen=True)
class _Widening:
    """Widens the intervals of ``result``: ``base``, or with effects in its model."""

    strategy: Strategy
    problem: SimulatedProblem
    base: Result
    result: Result
    prior: bool = False  # whether amplitudes of published answers have a prior about zero, as wide as their ranges

    def including(self, found: Sequence[OpenAnswer], note: str = HOLD_ALL) -> Result:
        """The result with intervals that include these answers."""
        result, others = self.result, [one.result for one in found if one.result]
        if others:
            held = not self.base.refused and any(one.label == BASELINE for one in found)
            whole = [self.base, *others] if held else others
            result = self.problem.including(result, [(None, one) for one in whole])
        return with_wider_intervals(result, widened(result.parameters, found), note)

    def baseline(self, at: FittedModel | None = None, elements: Iterable[str] = ()) -> OpenAnswer:
        """The baseline as an answer, with the bias by the unexplained residual of its fit ``at``, of ``elements``."""
        return OpenAnswer(BASELINE, self.base.parameters, self.biases(at, self.base, elements) if at else {})

    def averaged(self, fitted: FittedModel, more: Sequence[OpenAnswer] = ()) -> Result:
        """The result of this fit, with the intervals of its mixture with answers of one more effect and ``more``."""
        found = with_other_forms(self.probable(fitted), more)
        others = [(one.probability, one.result) for one in found if one.result]
        averaged = self.problem.including(self.result, others) if others else self.result
        return with_wider_intervals(averaged, widened(averaged.parameters, found))

    def probable(self, fitted: FittedModel, among: Collection[str] | None = None) -> list[OpenAnswer]:
        """The answers with one more effect than this fit, with their probabilities (``probable_answers``)."""
        each = probable_answers(self.strategy, fitted, among)
        return [replace(self.published([a])[0], probability=p) for a, p in each]

    def in_other_forms(self) -> list[OpenAnswer]:
        """The probable answers of one effect that acts by another form of its law, of steps with further numbers.

        Such an effect may stay below detection while the form that is tested explains too little to be probable.
        """
        names = {e.name for e in self.strategy.model.setup.effects if e.other_law is not None}
        opened = in_other_forms(self.strategy, names) if names and self.problem.has_further_numbers else None
        return [] if opened is None else replace(self, strategy=opened, prior=True).probable(opened.base, names)

    def published(
        self,
        answers: Iterable[CandidateModel],
        unexplained: bool = False,
        known: Mapping[tuple[str, ...], Result] = NO_RESULTS,
    ) -> list[OpenAnswer]:
        """The parameters with each answer in the model; those of the diagnosis's fit where the step publishes none.

        Parameters
        ----------
        unexplained : add the bias by the unexplained residual.
        known : results of answers that are published already, by the names of their effects.
        """
        found, candidates = [], self.strategy.model.setup.candidates
        for answer in answers:
            near = self.strategy.relinearized(answer.fitted)
            result = known.get(answer.effects)
            if result is None:
                result = publish_with(self.problem, [candidates[e] for e in answer.effects], near.values, self.prior)[0]
            bias = self.biases(near, result or self.result) if unexplained else {}
            parameters = result.parameters if result else by_fit(near.solution, self.result, self.problem.derived)
            found.append(OpenAnswer(_label(answer), parameters, bias, result=result))
        return found

    def biases(self, at: FittedModel, result: Result, elements: Iterable[str] = ()) -> dict[str, float]:
        """Half the 95 % interval of each published parameter's bias by the unexplained residual of a fit."""
        found = unexplained_biases(self.strategy.model, at, elements)
        fitted = {n: float(v) for n, v in at.values.items()}
        return biases(fitted, found, result.parameters, self.problem.derived)


def with_other_forms(found: Sequence[OpenAnswer], more: Sequence[OpenAnswer]) -> list[OpenAnswer]:
    """Probable answers and those of the same effects by another form of the law, with probabilities that sum up to one.

    Each of ``more`` has its probability p among all answers but the usual form of its effect, which has q: its odds to
    all answers of ``found`` are p / (1 - p) (1 - q).
    """
    usual = {one.label: one.probability or 0.0 for one in found}
    each = [(one, min(one.probability or 0.0, CERTAIN)) for one in more]
    odds = [(one, p / (1.0 - p) * (1.0 - usual.get(one.label, 0.0))) for one, p in each]
    total = 1.0 + sum(ratio for _, ratio in odds)
    both = [*((one, one.probability or 0.0) for one in found), *odds]
    return [replace(one, probability=ratio / total) for one, ratio in both]


def least_doubtful(answers: Sequence[OpenAnswer]) -> tuple[list[OpenAnswer], list[Finding]]:
    """The answers without those whose results have more doubts than another's, and a note on each that is left out.

    Such an answer makes parameters implausible, as a fading brake does that stands for most of the rolling resistance.
    Those without a published result are kept.
    """
    least = min((len(one.result.doubts) for one in answers if one.result), default=0)
    kept, notes = list[OpenAnswer](), list[Finding]()
    for one in answers:
        if one.result is None or len(one.result.doubts) == least:
            kept.append(one)
            continue
        doubt = one.result.doubts[0]
        what = f"the intervals do not include the answer '{one.label}', with which this is doubtful: {doubt.reason}"
        notes.append(Finding("diagnosis", what, doubt.got, minor=True))
    return kept, notes


def _beside_others(result: Result, others: Sequence[Result]) -> Result:
    """The prediction by one of several answers, with a note on how well the others predict."""
    if not others:
        return result
    rms = sorted(one.fit.rms for one in others)
    errors = f"{rms[0]:.3g}" if len(rms) == 1 else f"{rms[0]:.3g} to {rms[-1]:.3g}"
    which = "the other answer" if len(rms) == 1 else f"each of the {len(rms)} other answers"
    what = f"with {which} instead, the simulation is off by {errors} {result.fit.unit} rms ({result.fit.rms:.3g} now)"
    return replace(result, findings=(*result.findings, Finding("diagnosis", what, minor=True)))


def holding_free_curve(
    result: Result, curve: Sequence[Effect], law: Effect | None, problem: SimulatedProblem
) -> Result:
    """The result with intervals of its further numbers that include those with a part's free curve; see free_curve.

    A formula may deviate locally by more than its own interval: for example a sine at the flank of a step. A named law
    and the curve differ where they imitate each other: for example in the road load without a brake.

    Parameters
    ----------
    curve : the effects with which the curve is the answer; none where there is no such answer.
    law : the named law in place of which the curve is; a note states it.
    """
    if not curve or not result.parameters or not problem.has_further_numbers:
        return result
    found = publish_with(problem, curve)[0]
    if found is None:
        return result
    result = problem.including(result, [(None, found)])
    if law is None:
        return result
    what = f"{curve[-1].label} explains the runs as well as {law.label}; the intervals over speed include it"
    return replace(result, findings=(*result.findings, Finding("diagnosis", what, remedy=law.confirm, minor=True)))


def by_fit(
    fit: Solution, base: Result, derived: Callable[[Mapping[str, float]], Mapping[str, float]]
) -> dict[str, Estimate]:
    """The published parameters that a fit of the diagnosis determines, with its values and intervals.

    Those derived from fitted ones have the published interval times the ratio of what follows for both fits from the
    intervals of the fitted parameters: the interval then includes what else is uncertain, such as a frontal area.

    Parameters
    ----------
    derived : values of the unknowns -> published parameters derived from them.
    """
    found = {
        n: replace(e, value=float(fit.values[n]), std=float(fit.std[n]), interval95=fit.interval95[n])
        for n, e in base.parameters.items()
        if n in fit.values
    }
    before = {n: base.parameters[n] for n in found}
    values = {n: float(v) for n, v in fit.values.items()}
    now = propagated(found, fit.correlation, derived, values)
    published = propagated(before, base.parameters.correlation, derived)
    for name, value in derived(values).items():
        one = base.parameters.estimates.get(name)
        if one is not None and name not in found and published.get(name, 0.0) > 0:
            scale = now[name] / published[name]
            half = one.half_width * scale
            found[name] = replace(one, value=value, std=one.std * scale, interval95=(value - half, value + half))
    return found


def _label(answer: CandidateModel) -> str:
    return " + ".join(answer.effects)
