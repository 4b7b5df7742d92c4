"""Judges the candidate effects: detects a model error, and accepts the candidate models that explain it.

Which candidate models suffice: ``accepted_models`` in model_selection.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.diagnosis.detect.detectability import untestable
from vdyn_cli.diagnosis.detect.detection import Detection, detect
from vdyn_cli.diagnosis.gain.held_out_gain import HeldOutGain, Selection, held_out_gain
from vdyn_cli.diagnosis.judgment import (
    BEYOND_RANGE,
    HELD_OUT_WORSE,
    IMITATED,
    NO_GAIN,
    NONE_VISIBLE,
    NOT_SIGNIFICANT,
    Judgment,
)
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
from vdyn_cli.diagnosis.size.finding_size import Limits, finding_size, profile_matters, profile_size
from vdyn_cli.diagnosis.strategies.full_model import FittedModel
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.inference.regression import Unknown
from vdyn_cli.quantities.errors import Finding


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
    detection = detect(strategy, base)
    detected = detection.p_value <= model.setup.level
    insufficient = _insufficient(strategy, detection) or ("" if detection.testable or detected else NONE_VISIBLE)
    fault = f"{faults[0].where} {faults[0].what}" if faults else ""
    judgment = Judgment(base, detection, untestable(model, base, detection.scores), insufficient, fault)
    if insufficient or fault:
        return judgment
    if not detected:
        return replace(judgment, one_way=model.setup.one_way)
    local, local_detection = strategy.about_largest_effect(detection)
    answers, tried = accepted_models(local, local_detection)
    answers = _without_idle_effects(strategy, local, answers, limits) or _with_idle_remainder(local, tried, limits)
    judgment = _sized(strategy, replace(judgment, tried=tried, accepted=answers), limits)
    if not judgment.material:
        return replace(judgment, one_way=model.setup.one_way)
    judgment = _accepting(strategy, judgment, answers, local_detection)
    judgment = _with_gain(strategy, judgment, local) if judgment.answers else judgment
    named = [model.setup.candidates[name] for name in judgment.answer.effects] if judgment.answer else []
    if model.setup.one_way and any(effect.turns_with_heading or effect.begins_with_run for effect in named):
        return replace(judgment, one_way=model.setup.one_way, gain=None)
    return judgment


def _insufficient(strategy: Strategy, detection: Detection) -> str:
    """Why these data are insufficient for a diagnosis; empty where they suffice."""
    setup, runs, system = strategy.model.setup, len(strategy.model.regression.runs), detection.system
    if runs < setup.fewest_runs:
        verb = "s are" if runs > 1 else " is"
        return f"{runs} {setup.run}{verb} too few to separate an effect from noise (needed: {setup.fewest_runs})"
    if setup.too_short:
        return f"{setup.too_short}; effects are confounded in runs this short"
    if setup.mixed_directions:
        return f"{setup.mixed_directions}: wind, slope and resistance are confounded"
    units = system.units - system.prior_units
    unit = f"{system.kind}{'s' if units != 1 else ''}"
    if units < POLICY.fewest_units or system.effective_units < POLICY.fewest_effective_units:
        needed = f"needed: {POLICY.fewest_units}, effective number {POLICY.fewest_effective_units:g}"
        have = f"{units} {unit} (effective number {system.effective_units:.0f})"
        return f"{have} are too few to certify an effect ({needed})"
    if detection.scores.smallest_p() * POLICY.smallest_p_ratio > setup.level:
        return f"{units} {unit} cannot reach the level of {setup.level:.2g}"
    return ""


def _without_idle_effects(
    strategy: Strategy, local: Strategy, answers: Sequence[CandidateModel], limits: Limits | None
) -> tuple[CandidateModel, ...]:
    """The answers without effects that neither change the main output by more than the limit nor lower its error.

    Beside a large effect, the error of its law may look like a further effect. One without which much of the misfit is
    left, as of an accelerometer that is tilted, is none of these: it explains another channel. Only with predictions at
    prior values.
    """
    if limits is None or not strategy.prior_values:
        return tuple(answers)
    found = dict[tuple[str, ...], CandidateModel]()
    for answer in answers:
        kept = answer
        for effect in answer.effects if len(answer.effects) > 1 else ():
            rest = tuple(e for e in kept.effects if e != effect)
            less = candidate_model(local, rest) if rest else None
            size = finding_size(strategy, less.fitted, kept.fitted) if less and less.explains_most else None
            if less and size and size.plain and size.change <= limits.output and size.after >= size.before:
                kept = less
        found.setdefault(kept.effects, kept)
    return tuple(found.values())


def _with_idle_remainder(
    strategy: Strategy, tried: Sequence[CandidateModel], limits: Limits | None
) -> tuple[CandidateModel, ...]:
    """The single effects that explain most, if no free profile of what the best of them leaves changes predictions.

    No law is exact: the rolling resistance of a real tire leaves a residual that is significant beside a large effect.
    Only with predictions at prior values, and where no candidate but a free profile is strongest in that residual.
    """
    best = best_fit([t for t in tried if not t.unphysical])
    if best is None or limits is None or not strategy.prior_values or strategy.model.setup.far_off:
        return ()
    if not best.explains_most or best.residual_like not in strategy.model.setup.free_profiles:
        return ()
    if _profile_excludes(strategy, best.fitted) or profile_matters(strategy, best.fitted, limits):
        return ()
    most = [replace(t, residual_immaterial=True) for t in tried if t.explains_most and not t.unphysical]
    least = best.cost + 0.5 * POLICY.needed_t**2
    return simplest(strategy.model, [t for t in most if t.cost <= least], most)


def _sized(strategy: Strategy, judgment: Judgment, limits: Limits | None) -> Judgment:
    """The judgment with the size of the finding, and whether that matters.

    A finding matters if any of its answers does; without an answer, if the closest candidate model or a free profile
    does. Amplitudes that chance explains have no size: without a significant candidate, the free profile alone decides.
    """
    answers, closest = judgment.accepted, best_fit(judgment.tried)
    every = [a for a in (answers or ([closest] if closest else ())) if _is_significant(strategy, judgment.base, a)]
    sizes = [finding_size(strategy, judgment.base, a.fitted) for a in every]
    best = sizes[0] if sizes else None
    if limits is None or any(limits.exceeded(size) for size in sizes):
        return replace(judgment, size=best, material=True)
    if not (answers and every) and profile_matters(strategy, judgment.base, limits):
        return replace(judgment, size=None, material=True)  # the closest candidate changes nothing that matters
    if not every:
        size = profile_size(strategy, judgment.base) if strategy.prior_values else None
        return replace(judgment, size=size, material=False, accepted=(), closest=None)
    return replace(judgment, size=best, material=False, closest=None if answers else closest)


def _is_significant(strategy: Strategy, base: FittedModel, one: CandidateModel) -> bool:
    """Whether a candidate model explains more than chance, and its amplitude differs significantly from zero.

    All candidates count where an error is certain: the baseline is far off, or a free profile excludes it. Where
    predictions keep prior values, an error is judged by what it changes, however certain it is.
    """
    if strategy.model.setup.far_off or (not strategy.prior_values and _profile_excludes(strategy, base)):
        return True
    if 2 * (base.solution.cost - one.cost) <= POLICY.needed_t**2:
        return False
    return len(one.effects) > 1 or not may_be_zero(strategy.model, strategy.relinearized(one.fitted))


def _profile_excludes(strategy: Strategy, at: FittedModel) -> bool:
    """Whether the evidence of a free profile beside a fit reaches ``excluding_amplitude``, which chance does not."""
    found = strategy.model.scores(at, list(strategy.model.setup.free_profiles))
    return any(found.evidence[f] > POLICY.excluding_amplitude for f in found.names)


def _accepting(
    strategy: Strategy, judgment: Judgment, answers: tuple[CandidateModel, ...], local_detection: Detection
) -> Judgment:
    """The judgment with those answers that their amplitudes do not refute; their held-out gain is not computed."""
    model = strategy.model
    if not answers and (beyond := best_beyond_range(strategy, judgment.tried, local_detection)):
        return judgment.refuted(BEYOND_RANGE, beyond)
    if not answers:
        return judgment.refuted(closest=best_fit(judgment.tried if judgment.size is not None else ()))
    # Single effects that nearly suffice are preferred to several of which one may be zero.
    if len(answers) == 1 < len(answers[0].effects) and may_be_zero(model, strategy.relinearized(answers[0].fitted)):
        fewer = _certain_part(strategy, answers[0])
        answers = nearly_sufficient(judgment.tried) or ((fewer,) if fewer else answers)
    first = answers[0]
    if any(is_imitated(model, answer, local_detection) for answer in answers):
        return judgment.refuted(IMITATED, first)
    if len(answers) == 1 and may_be_zero(model, strategy.relinearized(first.fitted)):
        return judgment.refuted(NOT_SIGNIFICANT, first)
    return replace(judgment, accepted=answers)


def _certain_part(strategy: Strategy, answer: CandidateModel) -> CandidateModel | None:
    """The answer without the effects that may be zero, if the others still explain most; else None.

    Several weak effects that are collinear, such as a filter and the tires' damping, share a residual: none of them is
    certain, and a strong effect beside them is no less so. What it leaves is reported as the remainder.
    """
    fitted = strategy.relinearized(answer.fitted)
    kept = tuple(e for e in answer.effects if not may_be_zero(strategy.model, fitted, (e,)))
    fewer = candidate_model(strategy, kept) if kept else None
    if fewer is None or fewer.unphysical or not fewer.explains_most:
        return None
    return None if may_be_zero(strategy.model, strategy.relinearized(fewer.fitted)) else fewer


def _with_gain(strategy: Strategy, judgment: Judgment, local: Strategy) -> Judgment:
    """The judgment with its held-out gain; without an answer where the gain refutes it."""
    answers, found, base = judgment.answers, judgment.detection, judgment.base
    first, gain = answers[0], None
    if len(answers) == 1 or len(first.effects) > 1:  # several answers of several effects share most of them
        gain = held_out_gain(strategy, base, first.fitted, Selection(_scored(strategy, found), local.base))
    if gain is None:
        return judgment
    by_prior = all(found.scores.stated[e] > POLICY.prior_information for e in first.effects)
    if why := _refuted(strategy, gain, first, len(answers) > 1):
        if why != NO_GAIN or not by_prior:
            return judgment.refuted(why, first)
        gain = None  # the evidence is a contradicted prior, which predicted outputs do not show
    contradicted = _contradicted(strategy.model.regression.unknowns, base) if by_prior else None
    return replace(judgment, gain=gain, contradicted=contradicted)


def _scored(strategy: Strategy, found: Detection) -> tuple[str, ...]:
    """The testable candidates without latencies that have no evidence at zero: only a fit of their own shows these."""
    candidates, evidence = strategy.model.setup.candidates, found.scores.evidence
    hidden = {n for n in found.testable if candidates[n].latency and evidence[n] < POLICY.pair_evidence}
    return tuple(n for n in found.testable if not (strategy.nonlinear and n in hidden))


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


def keeping_answers(strategy: Strategy, judgment: Judgment, kept: tuple[CandidateModel, ...]) -> Judgment:
    """The judgment on these of its several answers; a single one must pass the tests of a named effect."""
    if not kept or len(kept) == len(judgment.answers):
        return judgment
    size = finding_size(strategy, judgment.base, kept[0].fitted)
    local, local_detection = strategy.about_largest_effect(judgment.detection)
    found = _accepting(strategy, replace(judgment, size=size), kept, local_detection)
    return _with_gain(strategy, found, local) if found.answers else found


def _judged_again(strategy: Strategy, judgment: Judgment, answers: tuple[CandidateModel, ...]) -> Judgment | None:
    """The judgment with these answers instead of its own; None where significance or held-out gain refutes them."""
    local, local_detection = strategy.about_largest_effect(judgment.detection)
    found = _accepting(strategy, judgment, answers, local_detection)
    found = _with_gain(strategy, found, local) if found.answers else found
    return found if found.answers else None
