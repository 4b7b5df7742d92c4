"""Tries candidate models, and selects those that are accepted as answers."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from scipy.special import chdtrc

from vdyn_cli.diagnosis.detect.detection import Detection
from vdyn_cli.diagnosis.gain.held_out_gain import rms_of
from vdyn_cli.diagnosis.name.candidate_models import (
    CandidateModel,
    alternatives,
    best_fit,
    catalog_falls_short,
    forward_selection,
    pairs,
    singles,
    singles_beyond_range,
    with_next,
)
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.full_model import FittedModel, FullModel
from vdyn_cli.diagnosis.strategies.strategy import Strategy


def accepted_models(
    strategy: Strategy, found: Detection
) -> tuple[tuple[CandidateModel, ...], tuple[CandidateModel, ...]]:
    """The answers (single effects that suffice, else pairs, else larger sets), and the single effects tried.

    One answer without rivals includes the further effects that its significant residual shows with certainty.
    """
    tried = singles(strategy, found)
    answers = _fewest_effects(strategy, tried, found)
    further = _with_certain_effects(strategy, answers[0]) if len(answers) == 1 else None
    if further is None:
        return answers, tried
    return (further, *alternatives(strategy, further, found)), tried


def _fewest_effects(
    strategy: Strategy, tried: tuple[CandidateModel, ...], found: Detection
) -> tuple[CandidateModel, ...]:
    """The answers of one effect among ``tried``, else of two, else of more."""
    model, best = strategy.model, best_fit(tried)
    answers = simplest(model, not_significantly_worse(model, tried), tried)
    short = best is not None and catalog_falls_short(strategy, best)
    if answers or short or _one_profile_suffices(strategy, best):
        return _with_rivals(strategy, answers or nearly_sufficient(tried), tried, found)
    two = pairs(strategy, tried, found)
    answers = simplest(model, not_significantly_worse(model, (*tried, *two)), two)
    answers = answers or nearly_sufficient(tried) or nearly_sufficient((*tried, *two))
    answers = tuple(a for a in answers if not worse_than_alone(strategy, a))
    if answers:
        return (*answers, *_with_equal_partners(strategy, answers, found))
    return forward_selection(strategy, tried, found)


def _with_certain_effects(strategy: Strategy, answer: CandidateModel) -> CandidateModel | None:
    """The answer with the further effects that its residual shows with certainty; None where there is none.

    Where a few blocks hold most of the information, as a bump does, sign flips have little power, and an effect that
    leaves much of the misfit may suffice. The amplitudes of further effects, relative to their scatter across blocks,
    then show what the flips do not. The set may leave a significant residual, which the intervals include.
    """
    found: CandidateModel | None = None
    tried = answer
    while _leaves_much(tried) and len(tried.effects) < POLICY.most_effects:
        further = with_next(strategy, tried)
        if further is None or not _all_certain(strategy, further):
            break
        strategy = strategy.about(further.fitted)
        found = tried = further
    return found


def _leaves_much(tried: CandidateModel) -> bool:
    """Whether the residual is significant at the level of a detection, and no negligible share of the misfit."""
    return tried.residual_p <= POLICY.level and tried.residual_share > POLICY.negligible_rest and not tried.unphysical


def _all_certain(strategy: Strategy, tried: CandidateModel) -> bool:
    """Whether each effect's first amplitude is as far from zero as one that excludes the baseline."""
    solution = strategy.relinearized(tried.fitted).solution
    first = [strategy.model.amplitudes(e)[0] for e in tried.effects]
    return all(abs(solution.values[n]) > POLICY.excluding_amplitude * solution.std[n] > 0 for n in first)


def _with_rivals(
    strategy: Strategy, answers: tuple[CandidateModel, ...], tried: tuple[CandidateModel, ...], found: Detection
) -> tuple[CandidateModel, ...]:
    """The answers of one effect, simpler ones that nearly suffice, and effects beyond their range that fit as well.

    Laws are not exact: with a large effect, a law with a shape parameter, such as a slow decay, can fit even the error
    of the true, simpler law, so that only the former suffices.
    """
    if not answers:
        return ()

    least = min(_unknowns(strategy, a) for a in answers)
    simpler = nearly_sufficient([t for t in tried if t not in answers and _unknowns(strategy, t) < least])
    beyond = singles_beyond_range(strategy, tried, found)
    every = (*tried, *beyond)
    stand = not_significantly_worse(strategy.model, every) or nearly_sufficient(every)
    return (*simpler, *answers, *(t for t in beyond if t in simplest(strategy.model, stand, every)))


def _unknowns(strategy: Strategy, one: CandidateModel) -> int:
    """The number of amplitudes and shapes of a candidate model's effects."""
    return sum(len(strategy.model.freed(e)) for e in one.effects)


def _with_equal_partners(
    strategy: Strategy, answers: tuple[CandidateModel, ...], found: Detection
) -> tuple[CandidateModel, ...]:
    """Pairs beyond the refitted ones that fit as well as the best answer; none where that is a single effect."""
    best = best_fit(answers)
    if best is None or len(best.effects) == 1:
        return ()
    already = {frozenset(a.effects) for a in answers}
    return tuple(a for a in alternatives(strategy, best, found) if a.sufficient and frozenset(a.effects) not in already)


def _one_profile_suffices(strategy: Strategy, best: CandidateModel | None) -> bool:
    """Whether one free profile leaves only noise: then the error is one effect that is not in the catalog.

    A profile that fits significantly worse than ``best`` of the effects tried leaves what that effect explains.
    """
    model = strategy.model
    for profile in model.setup.free_profiles:
        fitted = strategy.fitted((profile,))
        if fitted is None or (best is not None and 2 * (fitted.solution.cost - best.cost) > POLICY.needed_t**2):
            continue
        left = model.scores(fitted, list(model.setup.candidates))
        visible = [n for n in left.names if left.rank[n] and left.visibility[n] > POLICY.least_visibility]
        if left.p_value(visible) > POLICY.rest_level:
            return True
    return False


def best_beyond_range(strategy: Strategy, tried: Sequence[CandidateModel], found: Detection) -> CandidateModel | None:
    """The effect that would suffice if its amplitude were not beyond its plausible range; None without any.

    Of those that fit about as well, the one with the fewest unknowns: free shapes imitate the true, simpler law.

    Parameters
    ----------
    tried : the candidate models of one effect within their ranges. found : scores beside the baseline.
    """
    enough = [t for t in singles_beyond_range(strategy, tried, found, own=True) if t.sufficient]
    least = min((t.cost for t in enough), default=0.0)
    as_good = [t for t in enough if not _significantly_worse(t, least)]
    return min(as_good, key=lambda t: (_unknowns(strategy, t), t.cost), default=None)


def not_significantly_worse(model: FullModel, tried: Sequence[CandidateModel]) -> tuple[CandidateModel, ...]:
    """The sufficient candidate models that no model with as few unknowns beats significantly.

    2 (cost - least cost) <= needed_t^2; chance exceeds it in at most 0.13 % of the cases in which the model is true.
    """

    def size(one: CandidateModel) -> int:
        return max(POLICY.simple_unknowns, *(len(model.amplitudes(e)) for e in one.effects))

    return tuple(
        t
        for t in tried
        if t.sufficient and not _significantly_worse(t, min(o.cost for o in tried if size(o) <= size(t)))
    )


def nearly_sufficient(tried: Sequence[CandidateModel]) -> tuple[CandidateModel, ...]:
    """The candidate models that leave a negligible residual of a large misfit, and rivals that leave hardly more.

    That residual is the error of the laws, not noise: a rival is worse only if it leaves ``rest_ratio`` times as much.
    The number of unknowns is ignored, since it is small compared with what is explained.
    """
    if not any(t.nearly_sufficient for t in tried):
        return ()
    least = min(t.residual_share for t in tried if t.nearly_sufficient)
    return tuple(t for t in tried if t.residual_share <= POLICY.rest_ratio * least)


def simplest(
    model: FullModel, answers: Sequence[CandidateModel], tried: Sequence[CandidateModel]
) -> tuple[CandidateModel, ...]:
    """The answers without profiles where laws suffice, since a profile can imitate every simpler law.

    If only profiles suffice, the best must beat the laws among ``tried`` with a small residual by more than its
    additional unknowns explain by chance; else these laws are the answers.
    """

    def unknowns(one: CandidateModel) -> int:
        return sum(len(model.amplitudes(e)) for e in one.effects)

    laws = [t for t in tried if all(len(model.amplitudes(e)) <= POLICY.simple_unknowns for e in t.effects)]
    simple = tuple(t for t in answers if t in laws)
    if simple or not answers:
        return simple
    best = min(answers, key=lambda t: t.cost)
    fewer = [t for t in laws if t.residual_p > POLICY.imitation_level and unknowns(t) < unknowns(best)]
    close = [
        t for t in fewer if chdtrc(unknowns(best) - unknowns(t), 2 * (t.cost - best.cost)) > POLICY.imitation_level
    ]
    least = min((t.cost for t in close), default=0.0)
    return tuple(t for t in close if not _significantly_worse(t, least)) or tuple(answers)


def worse_than_alone(strategy: Strategy, answer: CandidateModel) -> bool:
    """Whether an answer of several effects misses the main channel by far more than one of them does alone.

    Only where the baseline is far off. The noise estimated with an answer contains what the answer leaves unexplained,
    and such a fit may trade the drift of a drive for its transients: further effects are then needed.
    """
    if len(answer.effects) == 1 or not strategy.model.setup.far_off:
        return False
    alone = [one for e in answer.effects if (one := strategy.fitted((e,))) is not None]
    least = min((rms_of(strategy.relinearized(one).runs) for one in alone), default=inf)
    return rms_of(strategy.relinearized(answer.fitted).runs) > POLICY.far_worse * least


def _significantly_worse(one: CandidateModel, least: float) -> bool:
    return 2 * (one.cost - least) > POLICY.needed_t**2


def may_be_zero(model: FullModel, fitted: FittedModel, effects: Sequence[str] = ()) -> bool:
    """Whether the amplitude of an effect with one unknown is not significantly different from zero.

    With a free shape parameter, the amplitude is uncertain even if the effect is certain; such effects are skipped.

    Parameters
    ----------
    effects : those of the fit that are judged; empty: all.
    """
    solution = fitted.solution
    each = [model.freed(e) for e in effects or fitted.effects]
    return any(abs(solution.values[n[0]]) < POLICY.named_t * solution.std[n[0]] for n in each if len(n) == 1)


def is_imitated(model: FullModel, answer: CandidateModel, found: Detection) -> bool:
    """Whether the answer is a profile that fits no better, within chance, than a free profile with fewer unknowns."""
    effect, *others = answer.effects
    if others or len(model.amplitudes(effect)) <= POLICY.simple_unknowns:
        return False
    scores = found.scores
    more = {f: scores.rank[effect] - scores.rank[f] for f in model.setup.free_profiles if scores.rank[f]}
    return any(
        chdtrc(df, scores.statistic[effect] - scores.statistic[f]) > POLICY.imitation_level
        for f, df in more.items()
        if df > 0
    )
