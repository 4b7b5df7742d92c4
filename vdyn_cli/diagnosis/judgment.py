"""Decides the verdict, one of six. ``judge`` takes these decisions in this order:

not_testable  too few data, no candidate would be visible, or all runs have the direction that imitates the effect
data_fault    a sensor did not measure
adequate      no model error is significant, or none that matters
unknown       no candidate model suffices, or the one that does is refuted: by its amplitude or by held-out runs
ambiguous     several suffice; these data cannot discriminate between them
named         one effect (or one set of effects) suffices; data_fault if it is a sensor error

Which candidate models suffice: ``accepted_models`` in model_selection. ``diagnose`` has the verdict revised three
times: ``with_part`` (part_judgment) names a law of the part at fault if that explains more than the candidates,
``with_nuisance_effects`` judges sensor errors that the baseline contains, such as the latency of a logger, and
``extended`` (extension) replaces or withdraws an answer that the step's exact model does not confirm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.diagnosis.detect.detection import Detection, detect
from vdyn_cli.diagnosis.detect.untestable import untestable
from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.gain.held_out_gain import HeldOutGain, Selection, held_out_gain
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel, best_fit, candidate_model
from vdyn_cli.diagnosis.name.model_selection import (
    accepted_models,
    best_beyond_range,
    is_imitated,
    may_be_zero,
    nearly_sufficient,
    not_significantly_worse,
    simplest,
)
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.size.finding_size import FindingSize, Limits, finding_size, profile_matters
from vdyn_cli.diagnosis.strategies.full_model import FittedModel
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.inference.regression import Unknown
from vdyn_cli.quantities.diagnosis import NotTestable, Verdict
from vdyn_cli.quantities.errors import Finding

HELD_OUT_WORSE = "the held-out error increases"
NO_GAIN = "the held-out error does not decrease"
NOT_SIGNIFICANT = "its amplitude is not significantly different from zero across blocks"
BEYOND_RANGE = "its amplitude is beyond the plausible range"
IMITATED = "a free profile with fewer unknowns fits equally well"


@dataclass(frozen=True)
class Judgment:
    """The verdict with its reasons.

    Parameters
    ----------
    why : for not_testable, what is missing; for a data fault found by the reader, that fault; for unknown, why the
        ``closest`` candidate model is no answer although it would suffice.
    answers : the candidate models that suffice: one if named, several if ambiguous.
    tried : all single effects and sets that were tried.
    closest : for unknown, the candidate model that explains most.
    gain : held-out gain of the answer.
    size : size of the finding: of the answer, of the first of several, or of ``closest``.
    material : whether the finding matters. A significant one that does not leaves the model adequate; ``immaterial`` is
        then the candidate model that explains most, and ``immaterial_suffices`` says whether it would be an answer.
    absorbed : the candidate model with a sensor error that the baseline contains as a nuisance parameter, where that is
        significant but does not matter, or is expected of the logger.
    expected : the largest size of that parameter that is expected of the logger, such as one row of a log with held
        values; 0 where the error does not matter.
    one_way_effects : labels of the effects that would explain the misfit of runs in one direction; empty where no
        error is detected; None where the verdict does not depend on the direction.
    confounded : the answers that suffice, but are confounded with others in runs of one direction.
    by_prior : most of the evidence is a contradiction between the baseline and a stated value, such as a drawing or a
        sensor zero; the answer then need not improve the prediction of an output.
    contradicted : the stated value that the baseline contradicts most, where one alone is contradicted.
    """

    verdict: Verdict
    why: str
    base: FittedModel
    detection: Detection
    untestable: tuple[NotTestable, ...]
    answers: tuple[CandidateModel, ...] = ()
    tried: tuple[CandidateModel, ...] = ()
    gain: HeldOutGain | None = None
    closest: CandidateModel | None = None
    size: FindingSize | None = None
    material: bool | None = None
    immaterial: CandidateModel | None = None
    immaterial_suffices: bool = False
    absorbed: CandidateModel | None = None
    expected: float = 0.0
    one_way_effects: tuple[str, ...] | None = None
    confounded: tuple[CandidateModel, ...] = ()
    by_prior: bool = False
    contradicted: str = ""

    @property
    def answer(self) -> CandidateModel | None:
        """The one answer, where there is one."""
        return self.answers[0] if len(self.answers) == 1 else None

    def unknown(self, why: str = "", closest: CandidateModel | None = None) -> Judgment:
        """The judgment as unknown: a model error without an answer, because of ``why``.

        ``closest`` is the best of the former answers by default.
        """
        closest = closest or best_fit(self.answers)
        return replace(self, verdict="unknown", why=why, answers=(), gain=None, closest=closest)

    @property
    def beyond_range(self) -> CandidateModel | None:
        """The effect that would suffice if its amplitude were plausible; None where there is no such effect."""
        return self.closest if self.verdict == "unknown" and self.why == BEYOND_RANGE else None

    @property
    def possible(self) -> tuple[CandidateModel, ...]:
        """The answers, or the effect beyond its plausible range where there are none."""
        return self.answers or ((self.beyond_range,) if self.beyond_range else ())

    @property
    def remainder(self) -> CandidateModel | None:
        """The model whose residual is reported: the answer, the best of several, or what comes closest."""
        return best_fit(self.answers) or self.closest or self.immaterial


def judge(strategy: Strategy, faults: Sequence[Finding] = (), limits: Limits | None = None) -> Judgment:
    """Detect a model error at the false-alarm level of the setup, and name the effect.

    Parameters
    ----------
    faults : sensors that did not measure; with any, no effect is named and the model is not called adequate. Too few
        data remain ``not_testable``.
    limits : what matters; None: everything that is significant.

    Raises
    ------
    ResultError : the baseline cannot be fitted.
    """
    model, base = strategy.model, strategy.base
    found = detect(strategy, base)
    detected = found.p_value <= model.setup.level
    judgment = Judgment("adequate", _insufficient(strategy, found), base, found, untestable(model, base, found.scores))
    if judgment.why or not (found.testable or detected):
        return replace(judgment, verdict="not_testable")
    if faults:
        return replace(judgment, verdict="data_fault", why=f"{faults[0].where} {faults[0].what}")
    if not detected:
        return _unless_one_way(judgment, model.setup)
    focused, seen = strategy.focused(found)
    answers, tried = accepted_models(focused, seen)
    answers = _without_idle_effects(strategy, focused, answers, limits)
    judgment = _sized(strategy, replace(judgment, tried=tried), answers, limits)
    if not judgment.material:
        return _unless_one_way(judgment, model.setup)
    judgment = _named(strategy, judgment, answers, seen)
    judgment = _with_gain(strategy, judgment, focused) if judgment.answers else judgment
    named = [model.setup.candidates[name] for name in judgment.answer.effects] if judgment.answer else []
    confounded = any(effect.turns_with_heading or effect.begins_with_run for effect in named)
    return _unless_one_way(judgment, model.setup) if confounded else judgment


def _insufficient(strategy: Strategy, found: Detection) -> str:
    """Why these data are insufficient for a diagnosis; empty where they suffice."""
    setup, runs, system = strategy.model.setup, len(strategy.model.regression.runs), found.system
    if runs < setup.fewest_runs:
        verb = "s are" if runs > 1 else " is"
        return f"{runs} {setup.run}{verb} too few to separate an effect from noise (needed: {setup.fewest_runs})"
    if setup.too_short:
        return f"{setup.too_short}; effects are confounded in runs this short"
    if setup.mixed_directions:
        return f"{setup.mixed_directions}: wind, slope and resistance are confounded"
    units = system.units - system.stated
    unit = f"{system.kind}{'s' if units != 1 else ''}"
    if units < POLICY.fewest_units or system.effective_units < POLICY.fewest_effective_units:
        needed = f"needed: {POLICY.fewest_units}, effective number {POLICY.fewest_effective_units:g}"
        have = f"{units} {unit} (effective number {system.effective_units:.0f})"
        return f"{have} are too few to certify an effect ({needed})"
    if found.scores.smallest_p() * POLICY.smallest_p_ratio > setup.level:
        return f"{units} {unit} cannot reach the level of {setup.level:.2g}"
    return ""


def _unless_one_way(judgment: Judgment, setup: DiagnosisSetup) -> Judgment:
    """The judgment itself, or ``not_testable`` where all runs have one direction.

    Resistance, wind and slope are then confounded: neither can their absence be certified nor one of them be named.
    """
    if not setup.one_way:
        return judgment
    named = [setup.candidates[name].label for answer in judgment.answers for name in answer.effects]
    kept = replace(judgment, answers=(), gain=None, confounded=judgment.answers)
    return replace(kept, verdict="not_testable", why=setup.one_way, one_way_effects=tuple(named))


def _without_idle_effects(
    strategy: Strategy, focused: Strategy, answers: Sequence[CandidateModel], limits: Limits | None
) -> tuple[CandidateModel, ...]:
    """The answers without effects that neither change the main output by more than the limit nor lower its error.

    Beside a large effect, the error of its law may look like a further effect. Only with predictions at prior values.
    """
    if limits is None or not strategy.prior_values:
        return tuple(answers)
    found = dict[tuple[str, ...], CandidateModel]()
    for answer in answers:
        kept = answer
        for effect in answer.effects if len(answer.effects) > 1 else ():
            rest = tuple(e for e in kept.effects if e != effect)
            less = candidate_model(focused, rest) if rest else None
            size = finding_size(strategy, less.fitted, kept.fitted) if less else None
            if less and size and size.plain and size.change <= limits.output and size.after >= size.before:
                kept = less
        found.setdefault(kept.effects, kept)
    return tuple(found.values())


def _sized(
    strategy: Strategy, judgment: Judgment, answers: Sequence[CandidateModel], limits: Limits | None
) -> Judgment:
    """The judgment with the size of the finding, and whether that matters.

    A finding matters if any of its answers does; without an answer, if the closest candidate model or a free profile
    does. If no candidate was strong enough to be tried, the free profile alone decides.
    """
    best = answers[0] if answers else best_fit(judgment.tried)
    size = None if best is None else finding_size(strategy, judgment.base, best.fitted)
    judgment = replace(judgment, size=size, material=True)
    if limits is None or (size is not None and limits.exceeded(size)):
        return judgment
    if any(limits.exceeded(finding_size(strategy, judgment.base, a.fitted)) for a in answers[1:]):
        return judgment
    if not answers and profile_matters(strategy, judgment.base, limits):
        return replace(judgment, size=None)  # the closest candidate changes nothing that matters
    return replace(judgment, material=False, immaterial=best, immaterial_suffices=bool(answers))


def _named(strategy: Strategy, judgment: Judgment, answers: tuple[CandidateModel, ...], seen: Detection) -> Judgment:
    """The verdict on the answers, before their held-out gain is computed."""
    model = strategy.model
    if not answers and (beyond := best_beyond_range(strategy, judgment.tried, seen)):
        return judgment.unknown(BEYOND_RANGE, beyond)
    if not answers:
        return judgment.unknown(closest=best_fit(judgment.tried if judgment.size is not None else ()))
    # Single effects that nearly suffice are preferred to several of which one may be zero.
    if len(answers) == 1 < len(answers[0].effects) and may_be_zero(model, strategy.relinearized(answers[0].fitted)):
        answers = nearly_sufficient(judgment.tried) or answers
    first = answers[0]
    if any(is_imitated(model, answer, seen) for answer in answers):
        return judgment.unknown(IMITATED, first)
    if len(answers) == 1 and may_be_zero(model, strategy.relinearized(first.fitted)):
        return judgment.unknown(NOT_SIGNIFICANT, first)
    fault = len(answers) == 1 and all(model.setup.candidates[e].sensor for e in first.effects)
    verdict: Verdict = "ambiguous" if len(answers) > 1 else "data_fault" if fault else "named"
    return replace(judgment, verdict=verdict, answers=answers)


def _with_gain(strategy: Strategy, judgment: Judgment, focused: Strategy) -> Judgment:
    """The judgment with its held-out gain; ``unknown`` where the gain refutes the answer."""
    answers, found, base = judgment.answers, judgment.detection, judgment.base
    first, gain = answers[0], None
    if len(answers) == 1 or len(first.effects) > 1:  # several answers of several effects share most of them
        gain = held_out_gain(strategy, base, first.fitted, Selection(found.testable, focused.base))
    if gain is None:
        return judgment
    by_prior = all(found.scores.stated[e] > POLICY.prior_information for e in first.effects)
    if why := _refuted(strategy, gain, first, len(answers) > 1):
        if why != NO_GAIN or not by_prior:
            return judgment.unknown(why, first)
        gain = None  # the evidence is a contradicted prior, which predicted outputs do not show
    contradicted = _contradicted(strategy.model.regression.unknowns, base) if by_prior else ""
    return replace(judgment, gain=gain, by_prior=by_prior, contradicted=contradicted)


def _contradicted(unknowns: Sequence[Unknown], base: FittedModel) -> str:
    """The stated value from which the baseline is farthest; empty if none is off by ``contradiction`` of its std."""
    off = {"": POLICY.contradiction}
    for u in unknowns:
        fitted = base.solution.per_run.get(u.name, base.values.get(u.name))
        if u.prior is not None and u.prior_stated and u.prior[1] > 0.0 and fitted is not None:
            off[u.name] = float(np.max(np.abs(np.asarray(fitted) - u.prior[0]))) / u.prior[1]
    return max(off, key=lambda name: off[name])


def _refuted(strategy: Strategy, gain: HeldOutGain, answer: CandidateModel, several: bool) -> str:
    """Why held-out data refute the answer; empty where they do not.

    They refute it if no held-out error decreases, or one increases significantly. At prior values, the error may
    increase although the effect is true: it may have compensated a wrong parameter. Then the refitted models decide.
    """
    many = len(answer.effects) > POLICY.compensating_effects
    if several:
        return HELD_OUT_WORSE if many and gain.prediction_worse else ""
    if gain.worse or ((many or not strategy.prior_values) and gain.prediction_worse):
        return HELD_OUT_WORSE
    return "" if gain.positive else NO_GAIN


def with_fewer_effects(strategy: Strategy, judgment: Judgment) -> Judgment | None:
    """The judgment that names fewer of an answer's effects, which nearly suffice; None where there is no such set.

    For answers of which the exact model does not confirm every effect.
    """
    answer = judgment.answer
    if answer is None or len(answer.effects) == 1:
        return None
    fewer = [t for t in nearly_sufficient(judgment.tried) if set(t.effects) < set(answer.effects)]
    best = best_fit(fewer)
    return _judged_again(strategy, judgment, (best,)) if best else None


def without_answer(strategy: Strategy, judgment: Judgment) -> Judgment | None:
    """The judgment without an answer that the exact model excludes, on the other effects; None where none suffices.

    In a linearized model, an effect may suffice with impossible parameters, such as a negative wheel inertia.
    """
    answer = judgment.answer
    if answer is None:
        return None
    others = tuple(t for t in judgment.tried if t.effects != answer.effects)
    answers = simplest(strategy.model, not_significantly_worse(strategy.model, others), others)
    if not answers:
        return None
    sized = replace(judgment, size=finding_size(strategy, judgment.base, answers[0].fitted))
    return _judged_again(strategy, sized, answers)


def _judged_again(strategy: Strategy, judgment: Judgment, answers: tuple[CandidateModel, ...]) -> Judgment | None:
    """The judgment with these answers instead of its own; None where significance or held-out gain refutes them."""
    focused, seen = strategy.focused(judgment.detection)
    found = _named(strategy, judgment, answers, seen)
    found = _with_gain(strategy, found, focused) if found.answers else found
    return found if found.answers else None


def resized(strategy: Strategy, judgment: Judgment, before: Judgment) -> Judgment:
    """The judgment with the size of its answer, recomputed if that differs from the answers of ``before``."""
    answer = judgment.answer
    if answer is None or any(a.effects == answer.effects for a in before.answers):
        return judgment
    return replace(judgment, size=finding_size(strategy, judgment.base, answer.fitted))
