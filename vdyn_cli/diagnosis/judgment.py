"""From the tests of candidates to one of six verdicts.

adequate      no model error is detected
named         one effect (or one set) suffices
ambiguous     several suffice: these data cannot discriminate between them
unknown       a model error that no candidate effect explains
not_testable  too few data
data_fault    the effect is a sensor's, or a sensor did not measure
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from vdyn_cli.diagnosis.candidate_models import (
    CandidateModel,
    alternatives,
    beyond_range,
    catalogue_falls_short,
    forward_selection,
    pairs,
    singles,
)
from vdyn_cli.diagnosis.detection import Detection, detect
from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.finding_size import FindingSize, Limits, finding_size, profile_matters
from vdyn_cli.diagnosis.full_model import FittedModel
from vdyn_cli.diagnosis.held_out_gain import HeldOutGain, Selection, held_out_gain
from vdyn_cli.diagnosis.model_selection import (
    is_imitated,
    may_be_zero,
    nearly_sufficient,
    not_significantly_worse,
    simplest,
)
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategy import Strategy
from vdyn_cli.diagnosis.untestable import UntestableEffect, untestable
from vdyn_cli.quantities.diagnosis import Verdict
from vdyn_cli.quantities.errors import Finding

HELD_OUT_WORSE = "the held-out error increases"
NO_GAIN = "the held-out error does not decrease"
NOT_SIGNIFICANT = "its amplitude is not significantly different from zero across blocks"
BEYOND_RANGE = "its amplitude is beyond the plausible range"
IMITATED = "a free profile with fewer unknowns fits equally well"


@dataclass(frozen=True)
class Judgment:
    """The verdict with its grounds.

    Parameters
    ----------
    why : for not_testable, what is missing; for a data fault that the reader found, which; for unknown, why not the
        candidate model that comes ``closest``, where it would suffice.
    answers : the candidate models that suffice: one if named, several if ambiguous.
    tried : all single effects and sets that were tried.
    closest : for unknown, what explains most of it.
    gain : of the answer, on held-out data.
    size : of the finding: of the answer, the first of several, or what comes closest.
    material : whether it matters. What is significant and does not matter leaves the model adequate; ``note`` is then
        what explains most of it, ``noted`` whether it would be an answer.
    one_way_effects : labels of the wind or slope that would explain the misfit of runs in one direction; empty where no
        error is detected; None where the verdict does not depend on the direction.
    by_prior : most of the evidence is that the baseline contradicts a stated value, such as a drawing or a zero; an
        output need not be predicted better then.
    """

    verdict: Verdict
    why: str
    base: FittedModel
    detection: Detection
    untestable: tuple[UntestableEffect, ...]
    answers: tuple[CandidateModel, ...] = ()
    tried: tuple[CandidateModel, ...] = ()
    gain: HeldOutGain | None = None
    closest: CandidateModel | None = None
    size: FindingSize | None = None
    material: bool | None = None
    note: CandidateModel | None = None
    noted: bool = False
    one_way_effects: tuple[str, ...] | None = None
    by_prior: bool = False

    @property
    def answer(self) -> CandidateModel | None:
        """The one answer, where there is one."""
        return self.answers[0] if len(self.answers) == 1 else None

    def unknown(self, why: str = "", closest: CandidateModel | None = None) -> Judgment:
        """A model error is present, and ``why`` no answer explains it; ``closest`` by default is the best answer."""
        best = closest or min(self.answers, key=lambda t: t.cost, default=None)
        return replace(self, verdict="unknown", why=why, answers=(), gain=None, closest=best)

    @property
    def beyond_range(self) -> CandidateModel | None:
        """The one effect that would suffice, were its amplitude plausible; None where there is no such effect."""
        return self.closest if self.verdict == "unknown" and self.why == BEYOND_RANGE else None

    @property
    def remainder(self) -> CandidateModel | None:
        """What is asked for what remains: the answer, the best of several, or what comes closest."""
        best = min(self.answers, key=lambda t: t.cost, default=None)
        return best or self.closest or self.note


def judge(strategy: Strategy, faults: Sequence[Finding] = (), limits: Limits | None = None) -> Judgment:
    """Detect a model error and name the effect. The false-alarm level is the setup's.

    Parameters
    ----------
    faults : sensors that did not measure: beside them neither an effect is named nor the model called adequate. Too
        few data are not testable all the same.
    limits : what matters; None: everything that is significant.

    Raises
    ------
    ResultError : the baseline cannot be fitted.
    """
    model, base = strategy.model, strategy.fitted(())
    assert base is not None
    found = detect(strategy, base)
    detected = found.p_value <= model.setup.level
    judgment = Judgment("adequate", _insufficient(strategy, found), base, found, untestable(model, base, found))
    if judgment.why or not (found.testable or detected):
        return replace(judgment, verdict="not_testable")
    if faults:
        return replace(judgment, verdict="data_fault", why=f"{faults[0].where} {faults[0].what}")
    if not detected:
        return _unless_one_way(judgment, model.setup)
    focused, seen = strategy.focused(found)
    answers, tried = _answers(focused, seen)
    judgment = _sized(strategy, replace(judgment, tried=tried), answers, limits)
    if not judgment.material:
        return _unless_one_way(judgment, model.setup)
    judgment = _named(strategy, judgment, answers, seen)
    judgment = _with_gain(strategy, judgment, focused) if judgment.answers else judgment
    named = [model.setup.candidates[name] for name in judgment.answer.effects] if judgment.answer else []
    turning = any(effect.turns_with_heading for effect in named)
    return _unless_one_way(judgment, model.setup) if turning else judgment


def _unless_one_way(judgment: Judgment, setup: DiagnosisSetup) -> Judgment:
    """The judgment itself, or ``not_testable`` where all runs have one direction.

    Resistance, wind and slope are then confounded: neither their absence nor a wind or slope alone can be certified.
    """
    if not setup.one_way:
        return judgment
    named = [setup.candidates[name].label for answer in judgment.answers for name in answer.effects]
    return replace(
        judgment, verdict="not_testable", why=setup.one_way, one_way_effects=tuple(named), answers=(), gain=None
    )


def with_fewer_effects(strategy: Strategy, judgment: Judgment) -> Judgment | None:
    """The judgment that names one of an answer's several effects, which nearly suffices alone; None without such.

    For answers of which the exact model does not confirm each effect.
    """
    answer = judgment.answer
    if answer is None or len(answer.effects) == 1:
        return None
    fewer = [t for t in nearly_sufficient(judgment.tried) if set(t.effects) < set(answer.effects)]
    if not fewer:
        return None
    focused, seen = strategy.focused(judgment.detection)
    found = _named(strategy, judgment, (min(fewer, key=lambda t: t.cost),), seen)
    found = _with_gain(strategy, found, focused) if found.answers else found
    return found if found.answers else None


def without_answer(strategy: Strategy, judgment: Judgment) -> Judgment | None:
    """The judgment on the other single effects, for an answer that the exact model excludes; None where none suffices.

    By a linearized model an effect may suffice with parameters that no vehicle has, as a wheel of negative inertia.
    """
    answer = judgment.answer
    if answer is None:
        return None
    others = tuple(t for t in judgment.tried if t.effects != answer.effects)
    answers = simplest(strategy.model, not_significantly_worse(strategy.model, others), others)
    if not answers:
        return None
    focused, seen = strategy.focused(judgment.detection)
    sized = replace(judgment, size=finding_size(strategy, judgment.base, answers[0].fitted))
    found = _named(strategy, sized, answers, seen)
    found = _with_gain(strategy, found, focused) if found.answers else found
    return found if found.answers else None


def _with_gain(strategy: Strategy, judgment: Judgment, focused: Strategy) -> Judgment:
    """The judgment with its held-out gain, unknown where that refutes it."""
    answers, found, base = judgment.answers, judgment.detection, judgment.base
    first, gain = answers[0], None
    if len(answers) == 1 or len(first.effects) > 1:  # effects that all answers share have a gain, too
        gain = held_out_gain(strategy, base, first.fitted, Selection(found.testable, focused.fitted(()) or base))
    if gain is None:
        return judgment
    by_prior = all(found.scores.stated[e] > POLICY.prior_information for e in first.effects)
    if why := _refuted(strategy, gain, first, len(answers) > 1):
        if why != NO_GAIN or not by_prior:
            return judgment.unknown(why, first)
        gain = None  # the baseline contradicts what is known beforehand: no output shows that
    return replace(judgment, gain=gain, by_prior=by_prior)


def resized(strategy: Strategy, judgment: Judgment, before: Judgment) -> Judgment:
    """The judgment with the size of its own answer, where that is another one than ``before``."""
    answer = judgment.answer
    if answer is None or any(a.effects == answer.effects for a in before.answers):
        return judgment
    return replace(judgment, size=finding_size(strategy, judgment.base, answer.fitted))


def _named(strategy: Strategy, judgment: Judgment, answers: tuple[CandidateModel, ...], seen: Detection) -> Judgment:
    """The verdict on the answers, before their gain is known."""
    model = strategy.model
    if not answers and (beyond := _beyond_alone(strategy, judgment.tried, seen)):
        return judgment.unknown(BEYOND_RANGE, beyond)
    if not answers:
        return judgment.unknown(closest=min(judgment.tried, key=lambda t: t.cost, default=None))
    answers = _significant(strategy, answers, judgment.tried)
    first = answers[0]
    if any(is_imitated(model, answer, seen) for answer in answers):
        return judgment.unknown(IMITATED, first)
    if len(answers) == 1 and may_be_zero(model, strategy.relinearized(first.fitted)):
        return judgment.unknown(NOT_SIGNIFICANT, first)
    fault = len(answers) == 1 and all(model.setup.candidates[e].sensor for e in first.effects)
    verdict: Verdict = "ambiguous" if len(answers) > 1 else "data_fault" if fault else "named"
    return replace(judgment, verdict=verdict, answers=answers)


def _significant(
    strategy: Strategy, answers: tuple[CandidateModel, ...], tried: Sequence[CandidateModel]
) -> tuple[CandidateModel, ...]:
    """The answers; in place of several effects of which one is insignificant, single effects that nearly suffice."""
    if len(answers) > 1 or len(answers[0].effects) == 1:
        return answers
    if not may_be_zero(strategy.model, strategy.relinearized(answers[0].fitted)):
        return answers
    return nearly_sufficient(tried) or answers


def _sized(
    strategy: Strategy, judgment: Judgment, answers: Sequence[CandidateModel], limits: Limits | None
) -> Judgment:
    """The judgment with the size of the finding, and whether that matters.

    A finding matters if any of its answers does; without an answer, if what comes closest or a free profile does. Where
    no candidate stands out enough to be tried, nothing comes closest, and the free profile alone decides.
    """
    closest = min(judgment.tried, key=lambda t: t.cost, default=None)
    best = answers[0] if answers else closest
    size = None if best is None else finding_size(strategy, judgment.base, best.fitted)
    judgment = replace(judgment, size=size, material=True)
    if limits is None or (size is not None and limits.exceeded(size)):
        return judgment
    if any(limits.exceeded(finding_size(strategy, judgment.base, a.fitted)) for a in answers[1:]):
        return judgment
    if not answers and profile_matters(strategy, judgment.base, limits):
        return judgment
    return replace(judgment, material=False, note=best, noted=bool(answers))


def _answers(strategy: Strategy, found: Detection) -> tuple[tuple[CandidateModel, ...], tuple[CandidateModel, ...]]:
    """The candidate models that stand, and the single effects that were tried: singles, then pairs, then more."""
    model, tried = strategy.model, singles(strategy, found)
    answers = simplest(model, not_significantly_worse(model, tried), tried)
    best = min(tried, key=lambda t: t.cost, default=None)
    short = best is not None and catalogue_falls_short(strategy, best)
    if answers or short or _one_profile_suffices(strategy):
        return _with_rivals(strategy, answers or nearly_sufficient(tried), tried, found), tried
    two = pairs(strategy, tried, found)
    answers = simplest(model, not_significantly_worse(model, (*tried, *two)), two)
    answers = answers or nearly_sufficient(tried) or nearly_sufficient((*tried, *two))
    if answers:
        return answers, tried
    chain = forward_selection(strategy, found)
    return (() if chain is None else (chain, *alternatives(strategy, chain, found))), tried


def _with_rivals(
    strategy: Strategy, answers: tuple[CandidateModel, ...], tried: tuple[CandidateModel, ...], found: Detection
) -> tuple[CandidateModel, ...]:
    """The answers of one effect, simpler ones that nearly suffice, and effects beyond their range that fit as well.

    Laws are not exact: beside a large effect the shape of another one, such as a slow decay, fits what its law leaves.
    """
    if not answers:
        return ()
    least = min(_unknowns(strategy, t) for t in answers)
    simpler = nearly_sufficient([t for t in tried if t not in answers and _unknowns(strategy, t) < least])
    beyond = beyond_range(strategy, tried, found)
    every = (*tried, *beyond)
    stand = not_significantly_worse(strategy.model, every) or nearly_sufficient(every)
    return (*simpler, *answers, *(t for t in beyond if t in simplest(strategy.model, stand, every)))


def _unknowns(strategy: Strategy, one: CandidateModel) -> int:
    return sum(len(strategy.model.freed(e)) for e in one.effects)


def _beyond_alone(strategy: Strategy, tried: Sequence[CandidateModel], found: Detection) -> CandidateModel | None:
    """The best effect that would suffice if its amplitude were not beyond its plausible range."""
    stand = [t for t in beyond_range(strategy, tried, found) if t.sufficient]
    return min(stand, key=lambda t: t.cost, default=None)


def _refuted(strategy: Strategy, gain: HeldOutGain, answer: CandidateModel, several: bool) -> str:
    """Why held-out data refute the answer, however much of the fitted runs it explains; empty where they do not.

    They do where no held-out error decreases, or one increases with certainty. At prior values it may although the
    effect is true: two errors that compensated each other are one left. Then the refitted models must predict better.
    """
    many = len(answer.effects) > POLICY.compensating_effects
    if several:
        return HELD_OUT_WORSE if many and gain.prediction_worse else ""
    if gain.worse or ((many or not strategy.prior_values) and gain.prediction_worse):
        return HELD_OUT_WORSE
    return "" if gain.positive else NO_GAIN


def _insufficient(strategy: Strategy, found: Detection) -> str:
    """What these data lack for a diagnosis; empty where they suffice."""
    setup, runs, units = strategy.model.setup, strategy.model.runs, found.units - found.stated
    if runs < setup.fewest_runs:
        return f"{runs} {setup.run}{'s are' if runs > 1 else ' is'} too few to separate an effect from noise"
    if setup.too_short:
        return f"{setup.too_short}; effects are confounded in runs this short"
    if setup.mixed_directions:
        return f"{setup.mixed_directions}: wind, slope and resistance are confounded"
    unit = f"{found.unit}{'s' if units != 1 else ''}"
    if units < POLICY.fewest_units or found.effective_units < POLICY.fewest_effective_units:
        return f"{units} {unit} (effective number {found.effective_units:.0f}) are too few to certify an effect"
    if found.smallest_p * POLICY.smallest_p_ratio > setup.level:
        return f"{units} {unit} cannot reach the level of {setup.level:.2g}"
    return ""


def _one_profile_suffices(strategy: Strategy) -> bool:
    """Whether a single free profile explains everything: then it is one effect that the catalogue lacks."""
    model = strategy.model
    for family in model.setup.families:
        fitted = strategy.fitted((family,))
        if fitted is None:
            continue
        left = model.scores(fitted, list(model.setup.candidates))
        visible = [n for n in left.names if left.rank[n] and left.visibility[n] > POLICY.least_visibility]
        if left.p_value(visible) > POLICY.rest_level:
            return True
    return False
