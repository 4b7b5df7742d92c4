"""Adds the part of the model at fault to the evidence: first the part is found, then its law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import inf, isfinite

from scipy.special import chdtrc

from vdyn_cli.diagnosis.detect.detection import detect
from vdyn_cli.diagnosis.gain.held_out_gain import HeldOutGain, held_out_gain
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel, all_needed, candidate_model, with_next
from vdyn_cli.diagnosis.part.learned_law import Learned, fitted_forms, learned
from vdyn_cli.diagnosis.part.part_finding import LawWithin, PartFinding, part_finding
from vdyn_cli.diagnosis.part.part_search import rms_share
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.size.finding_size import finding_size
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.effects import Effect
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps import SimulatedProblem
from vdyn_cli.steps.free_part import Part


@dataclass(frozen=True)
class PartJudgment:
    """A judgment with the part of the model at fault.

    Parameters
    ----------
    strategy : of the judgment's fits. finding : the part; None where none was searched or none has evidence.
    law : the law of the catalog within the part that the judgment names. learned : the learned law that it names.
    """

    strategy: Strategy
    judgment: Judgment
    finding: PartFinding | None = None
    law: LawWithin | None = None
    learned: Learned | None = None


def free_curve(found: PartJudgment, judgment: Judgment, extended: Sequence[str]) -> tuple[Effect, ...]:
    """The part's free curve, and the effects beside it, where it is another answer about the vehicle; else none.

    It is one beside a learned formula, beside a named law of the catalog that explains no more than the curve (a brake
    that fades, where all runs begin at the same speed), and where no answer is accepted. A curve over time, position
    or direction belongs to the test: it says nothing about the vehicle.

    Parameters
    ----------
    judgment : the final one, of which ``found`` contains an earlier stage. extended : the effects in the model.
    """
    finding, law, learned_law = found.finding, found.law, found.learned
    named = judgment.answer.effects if judgment.answer is not None else ()
    if finding is None or not finding.curves or any(p.reads for p in finding.parts) or tuple(extended) != named:
        return ()
    if learned_law is not None:
        return (learned_law.free,) if learned_law.free is not None and named == (learned_law.name,) else ()
    if judgment.verdict != "unknown" and (
        law is None or law.effect not in named or _beyond_curve(finding, (law.effect,))
    ):
        return ()
    curve = learned(finding, None, (), label_of(finding.parts)).effect
    candidates = found.strategy.model.setup.candidates
    return (*(candidates[e] for e in named if law is None or e != law.effect), curve) if curve.lasts else ()


def _beyond_curve(finding: PartFinding, effects: Sequence[str]) -> bool:
    """Whether effects explain clearly more than the free curve of the part: they then depend on something else."""
    more = _more_by_curve(finding, effects)
    return more is not None and more < -2 * POLICY.clearly_better


def _more_by_curve(finding: PartFinding, effects: Sequence[str]) -> float | None:
    """Twice the log likelihood by which the part's free curve explains more than effects, each beyond chance.

    The difference of Akaike's criterion with the effective numbers of coefficients; None where the effects' fit fails.
    """
    search, fitted = finding.search, finding.search.with_effects(effects)
    return None if fitted is None else (search.explained(finding.fitted) - search.explained(fitted)) / search.floor


def with_part(strategy: Strategy, judgment: Judgment, problem: SimulatedProblem) -> PartJudgment:
    """The judgment by the part of the model at fault; see _by_part and _beside_its_curve.

    A part that does not suffice changes nothing.
    """
    return _beside_its_curve(_by_part(strategy, judgment, problem))


def _beside_its_curve(found: PartJudgment) -> PartJudgment:
    """The judgment with the part's curve as an answer beside a law of the test that explains no more than the curve.

    Where all runs begin at one speed, a brake that fades with time and a force over speed are collinear, and neither is
    the only answer. Where the starts differ, one of them explains clearly more. The curve is the first answer where it
    does. It is no further answer where one of them is a law of the vehicle, which is one shape of the curve, nor beside
    a sensor error, which a curve over the sensor's signal imitates.
    """
    finding, judgment, candidates = found.finding, found.judgment, found.strategy.model.setup.candidates
    if finding is None or found.learned is not None or not finding.explains_most:
        return found
    named = {e for a in judgment.answers for e in a.effects}
    passing = {e for e in named if not candidates[e].lasts and not candidates[e].sensor}
    law = next((w.effect for w in finding.laws if w.effect in passing), None)
    if law is None or any(all(candidates[e].lasts for e in a.effects) for a in judgment.answers):
        return found
    curve, more = learned(finding, None, (), label_of(finding.parts)), _more_by_curve(finding, (law,))
    if not curve.effect.lasts or more is None or more < -2 * POLICY.clearly_better:
        return found
    opened = _with_candidate(found.strategy, curve)
    if opened is None:
        return found
    effects = next(a.effects for a in judgment.answers if law in a.effects)
    other = candidate_model(opened, (*(e for e in effects if e != law), curve.name))
    same = [m for a in judgment.answers if (m := candidate_model(opened, a.effects)) is not None]
    if other is None or not same or other.unphysical or not other.explains_most:
        return found
    judgment, answers = _about(opened, judgment), (*same, other)
    if more > 2 * POLICY.clearly_better:
        answers = (other, *same)
        judgment = replace(judgment, gain=held_out_gain(opened, judgment.base, other.fitted))
    tried = (*(t for t in judgment.tried if all(t.effects != a.effects for a in answers)), *answers)
    return replace(found, strategy=opened, judgment=replace(judgment, tried=tried, accepted=answers))


def _by_part(strategy: Strategy, judgment: Judgment, problem: SimulatedProblem) -> PartJudgment:
    """The judgment, with another answer if a part of the model at fault explains more than the candidates.

    The part is used if no candidate suffices, if the part explains much more than each answer, or if each answer is a
    law of the part with a further effect that only corrects its shape. Then the law of the catalog that follows the
    part's curve is named if it predicts held-out runs better; else two laws that together do, else the law learned from
    the curve. A part that does not suffice changes nothing. Answers that leave only noise are replaced only by laws of
    the catalog that fit clearly better, or by a learned law that predicts held-out runs better.
    """
    detected = judgment.verdict in ("named", "ambiguous", "unknown")
    # A problem of a plug-in may have no parts.
    parts = getattr(problem, "parts", ())
    if not detected or not parts or judgment.beyond_range or _explained_elsewhere(strategy, judgment, parts):
        return PartJudgment(strategy, judgment)
    finding = part_finding(strategy, problem)
    if finding is None:
        return PartJudgment(strategy, judgment)
    same = PartJudgment(strategy, judgment, finding, _named_law(judgment, finding))
    more = judgment.verdict == "unknown" or _surpassed(judgment, finding)
    if not finding.explains or not (more or _beside_a_law(strategy, judgment, finding)):
        return same
    for law in finding.laws:
        named = _with_law(strategy, judgment, law) if law.follows else None
        if named is not None and not (more and _equalled(judgment, named.accepted[0])):
            return PartJudgment(strategy, _resized(strategy, named, judgment), finding, law)
    if not more:
        return same
    # A law over the position on the road, or of a wind, reads no signal of the model that a learned law could read.
    # In drives, an error of the torque's gain as a rival is another answer: it does not imitate a force.
    if any(p.reads is not None for p in finding.parts) or (strategy.prior_values and finding.rivals):
        return same
    if (two := _with_two_laws(strategy, judgment, finding)) is not None:
        return PartJudgment(strategy, _resized(strategy, two, judgment), finding)
    found = _with_learned_law(strategy, judgment, finding)
    if found is None:
        return same
    extended, named, learned = found
    return PartJudgment(extended, _resized(extended, named, judgment), finding, None, learned)


def _explained_elsewhere(strategy: Strategy, judgment: Judgment, parts: Sequence[Part]) -> bool:
    """Whether the one answer, which acts on none of these parts, explains as much as a part at fault must."""
    if judgment.answer is None or judgment.gain is None:
        return False
    candidates = strategy.model.setup.candidates
    if any(p.concerns(candidates[n]) for p in parts for n in judgment.answer.effects if n in candidates):
        return False
    return judgment.gain.share >= rms_share(POLICY.part_squares)


def label_of(parts: Sequence[Part]) -> str:
    """The label of parts of one element: "the rear damper's force", "the dampers' force"."""
    first = parts[0]
    return first.what if len(parts) == 1 else first.what.replace(f"{first.place} ", "").replace("'s ", "s' ")


def _named_law(judgment: Judgment, finding: PartFinding) -> LawWithin | None:
    """The law within the part that the judgment names already; None where it names none."""
    named = judgment.answer.effects if judgment.answer is not None else ()
    return next((law for law in finding.laws if law.effect in named), None)


def _surpassed(judgment: Judgment, finding: PartFinding) -> bool:
    """Whether the part explains much more than each answer, so that none of the answers is the true effect.

    An answer whose refit fails here, such as one at a bound, stands if it is sufficient. Of an answer of more than
    ``compensating_effects``, which together imitate one law, the part must only explain clearly more.
    """
    search = finding.search
    most = search.explained(finding.fitted)
    for answer in judgment.answers:
        fitted = search.with_effects(answer.effects)
        if fitted is None and answer.sufficient:
            return False
        if fitted is None:
            continue
        explained = search.explained(fitted)
        share = 1.0 if len(answer.effects) > POLICY.compensating_effects else POLICY.part_squares
        if explained >= share * most or most - explained < 2 * POLICY.clearly_better * search.floor:
            return False
    return True


def _beside_a_law(strategy: Strategy, judgment: Judgment, finding: PartFinding) -> bool:
    """Whether each answer is a law of the part with a further effect, which only corrects the shape of that law.

    A profile, such as that of a road, can have any shape: an effect needed beside it is a separate one. So is one with
    which the law explains more than any curve of the part does.
    """
    model = strategy.model
    laws = {w.effect for w in finding.laws if w.follows and len(model.amplitudes(w.effect)) <= POLICY.simple_unknowns}
    answers = judgment.answers
    corrected = bool(answers) and all(len(a.effects) > 1 and laws & set(a.effects) for a in answers)
    return corrected and not any(_beyond_curve(finding, a.effects) for a in answers)


def _with_law(strategy: Strategy, judgment: Judgment, law: LawWithin) -> Judgment | None:
    """The judgment that names a law of the catalog; None if it fails, is unphysical, or its gain is not positive.

    If the law leaves much that one further effect explains, both are named if they predict held-out runs better.
    """
    answer = candidate_model(strategy, (law.effect,))
    if answer is None or answer.unphysical:
        return None
    gain = held_out_gain(strategy, judgment.base, answer.fitted)
    more = None if answer.explains_most else with_next(strategy, answer)
    if gain is not None and more is not None and more.explains_most and all_needed(strategy, more):
        further = held_out_gain(strategy, judgment.base, more.fitted)
        if further is not None and further.after < min(gain.before, gain.after):
            answer, gain = more, further
    tried = (*(t for t in judgment.tried if t.effects != answer.effects), answer)
    return _naming(replace(judgment, tried=tried), answer, gain)


def _equalled(judgment: Judgment, law: CandidateModel) -> bool:
    """Whether another answer that leaves only noise is not clearly worse than a law: then it is as likely."""
    others = [a for a in judgment.answers if a.sufficient and a.effects != law.effects]
    return any(a.cost < law.cost + POLICY.clearly_better for a in others)


def _with_two_laws(strategy: Strategy, judgment: Judgment, finding: PartFinding) -> Judgment | None:
    """The judgment that names two laws of the part, which together explain what its free curve does; None without such.

    A part may depart from its law in two ways at once, as a damper of other rates in rebound and in fast strokes. Laws
    of another coordinate, such as a wear over time beside a friction over the sliding speed, follow no curve together.
    """
    search, model = finding.search, strategy.model
    simple = [w for w in finding.laws if len(model.amplitudes(w.effect)) <= POLICY.simple_unknowns]
    names = [w.effect for w in simple if isfinite(w.share_of_curve)]
    found: list[tuple[float, CandidateModel]] = []
    for pair in combinations(names, 2):
        fitted = search.with_effects(pair)
        if fitted is None or search.share_of_part(fitted, finding.fitted) < POLICY.law_share:
            continue
        answer = candidate_model(strategy, pair)
        if answer is not None and not answer.unphysical and all_needed(strategy, answer):
            found.append((fitted.squares, answer))
    best = min(found, key=lambda one: one[0], default=None)
    return None if best is None else _naming(judgment, best[1], held_out_gain(strategy, judgment.base, best[1].fitted))


def _naming(judgment: Judgment, answer: CandidateModel, gain: HeldOutGain | None) -> Judgment | None:
    """The judgment that names this answer; None where its held-out gain is not positive."""
    return None if gain is not None and not gain.positive else judgment.naming(answer, gain)


def _resized(strategy: Strategy, named: Judgment, before: Judgment) -> Judgment:
    """The judgment with the size of its answer, computed if that differs from the answers of ``before``."""
    (answer,) = named.accepted
    if any(a.effects == answer.effects for a in before.answers):
        return named
    return replace(named, size=finding_size(strategy, named.base, answer.fitted))


def _with_learned_law(
    strategy: Strategy, judgment: Judgment, finding: PartFinding
) -> tuple[Strategy, Judgment, Learned] | None:
    """The strategy with the learned law as a further candidate, and the judgment that names it.

    A formula is tried first if one is not significantly worse than the free curve; then the table.

    Returns
    -------
    None if every fit fails, leaves much of the misfit, or predicts held-out runs no better than the baseline and the
    answers that leave only noise, or if these explain as much but for what its additional unknowns explain by chance.
    (The search compares the fits by the noise that remains beside free curves.)
    """
    rivals = [held_out_gain(strategy, judgment.base, a.fitted) for a in judgment.answers if a.sufficient]
    least = min((r.after for r in rivals if r is not None), default=inf)
    forms = fitted_forms(finding)
    good, label = [f.form for f in forms if f.sufficient], label_of(finding.parts)
    for form in (forms[0], None) if good else (None,):
        law = learned(finding, form, good, label)
        named = _naming_law(strategy, judgment, law, least, len(finding.search.gains))
        if named is not None:
            return (*named, law if form is None else replace(law, free=learned(finding, None, good, label).effect))
    return None


def _naming_law(
    strategy: Strategy, judgment: Judgment, law: Learned, least: float, parts: int
) -> tuple[Strategy, Judgment] | None:
    extended = _with_candidate(strategy, law)
    answer = candidate_model(extended, (law.name,)) if extended is not None else None
    if extended is None or answer is None or answer.unphysical or not answer.explains_most:
        return None
    if any(_imitates(extended, answer, a, parts) for a in judgment.answers if a.sufficient):
        return None
    gain = held_out_gain(extended, extended.base, answer.fitted)
    if gain is None or gain.after >= min(gain.before, least):
        return None
    found = _about(extended, judgment)
    return extended, replace(found, tried=(*judgment.tried, answer)).naming(answer, gain)


def _imitates(strategy: Strategy, law: CandidateModel, answer: CandidateModel, parts: int) -> bool:
    """Whether a learned law explains no more than an answer, but for what its additional unknowns explain by chance.

    The law is of the likeliest of so many ``parts``, each of which had this chance. An answer that explains clearly
    less of the misfit than the law, as in ``_surpassed``, is not imitated.
    """
    same, model = candidate_model(strategy, answer.effects), strategy.model
    if same is None or 1.0 - same.residual_share**2 < POLICY.part_squares * (1.0 - law.residual_share**2):
        return False
    more = len(model.freed(law.effects[0])) - sum(len(model.freed(e)) for e in same.effects)
    return bool(parts * chdtrc(max(more, 1), max(2 * (same.cost - law.cost), 0.0)) > POLICY.imitation_level)


def _with_candidate(strategy: Strategy, law: Learned) -> Strategy | None:
    """The strategy with a learned law as a further candidate; None where its baseline cannot be fitted."""
    setup = strategy.model.setup
    try:
        extended = open_strategy(replace(setup, effects=(*setup.effects, law.effect), learned=frozenset({law.name})))
        extended.base  # noqa: B018 - fitted when it is first read
    except (ResultError, ArithmeticError):
        return None
    return extended


def _about(extended: Strategy, judgment: Judgment) -> Judgment:
    """The judgment with the baseline's fit and the scores of a strategy with a further candidate."""
    found = detect(extended, extended.base)
    detection = replace(judgment.detection, scores=found.scores, testable=found.testable)
    return replace(judgment, base=extended.base, detection=detection)
