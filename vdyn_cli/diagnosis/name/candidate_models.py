"""Candidate models: the baseline with one or more effects, refitted, and the tests of their residuals.

An effect is named if it suffices (with it in the model, no other candidate is significant), not if it ranks first. An
effect that only improves the fit is no answer: a brake drag removes most of the error that a headwind causes.

``found`` are the scores of the candidates beside the baseline, ``tried`` the candidate models of one effect.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations
from math import inf, sqrt

from vdyn_cli.diagnosis.detect.detection import Detection, is_testable, p_value
from vdyn_cli.diagnosis.detect.scores import equivalent, scores
from vdyn_cli.diagnosis.gain.held_out_gain import rms_of
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.full_model import FittedModel, FullModel, hopeless_cost
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.steps.added_effects import NO_EFFECTS


@dataclass(frozen=True)
class CandidateModel:
    """The fitted baseline with some effects, and the tests of its residual.

    Parameters
    ----------
    residual_p : p value of the other candidates and of the profiles in the residual.
    residual_like : the candidate or profile that is strongest in the residual.
    residual_share : what that one would explain in addition, beyond chance, as a share of the rms misfit: the root of
        the ratio of whitened sums of squares.
    residual_in_part : whether that one corrects a law that one of the effects corrects, too.
    residual_immaterial : whether no free profile of the residual changes the output by more than what matters.
    unphysical : a parameter of the baseline that is significantly outside its physical range; empty where none is.
    sensor_fault : whether all of its effects are sensor errors, and not all of them latencies.
    """

    effects: tuple[str, ...]
    fitted: FittedModel
    residual_p: float
    residual_like: str | None
    residual_share: float
    residual_in_part: bool = False
    residual_immaterial: bool = False
    unphysical: str = ""
    sensor_fault: bool = False

    @property
    def cost(self) -> float:
        """Half the sum of squares of the whitened residuals."""
        return self.fitted.solution.cost

    @property
    def sufficient(self) -> bool:
        """Whether the residual is not significantly different from noise, with physically possible parameters."""
        return self.residual_p > POLICY.rest_level and not self.unphysical

    @property
    def nearly_sufficient(self) -> bool:
        """Whether the residual is negligible although significant; a single effect may leave more in its own part."""
        alone = len(self.effects) == 1 and self.residual_in_part
        least = POLICY.negligible_rest if alone else POLICY.exact_rest
        return self.residual_share < least and not self.unphysical

    @property
    def explains_most(self) -> bool:
        """Whether it explains at least ``part_squares`` of the squared misfit, or leaves no significant residual."""
        return self.residual_p > POLICY.rest_level or self.residual_share**2 <= 1 - POLICY.part_squares


def best_fit(models: Sequence[CandidateModel]) -> CandidateModel | None:
    """The candidate model with the least cost; None without any."""
    return min(models, key=lambda m: m.cost, default=None)


def singles(strategy: Strategy, found: Detection) -> tuple[CandidateModel, ...]:
    """A candidate model for each effect that could be the whole answer and can be fitted, the strongest first."""
    return _each_alone(lambda name: strategy, _likely_singles(strategy, found), ())


def _likely_singles(strategy: Strategy, found: Detection) -> list[str]:
    """The candidates whose evidence reaches ``single_evidence`` and ``single_share``, the strongest first.

    Latencies are also among them: a score at zero says little about a large delay, or a lag, which a shift of the
    whole run imitates to first order.
    """
    evidence, candidates = found.scores.evidence, strategy.model.setup.candidates
    most = max((evidence[n] for n in found.testable), default=0.0)
    least = max(POLICY.single_evidence, POLICY.single_share * most)
    likely = {n for n in found.testable if evidence[n] >= least}
    if strategy.nonlinear:
        likely |= {n for n in found.testable if candidates[n].latency}
    return sorted(likely, key=lambda n: -evidence[n])


def singles_beyond_range(
    strategy: Strategy, tried: Sequence[CandidateModel], found: Detection, own: bool = False
) -> tuple[CandidateModel, ...]:
    """Models of single effects with amplitudes beyond their plausible range, up to ``open_range`` times it.

    ``own``: each linearized about its own fit where the baseline is far off; their costs are then not comparable.
    """
    names = [n for n in _likely_singles(strategy, found) if all(t.effects != (n,) for t in tried)]
    return _each_alone(lambda name: strategy.with_open_range(name if own else ""), names, tried)


def _each_alone(
    strategy_of: Callable[[str], Strategy], names: Sequence[str], before: Sequence[CandidateModel]
) -> tuple[CandidateModel, ...]:
    """A candidate model for each effect alone; beside one that suffices, the fits of hopeless ones end early."""
    models: list[CandidateModel] = []
    for name in names:
        strategy, best = strategy_of(name), best_fit([m for m in (*before, *models) if m.sufficient])
        below = inf if best is None else hopeless_cost(strategy.base.solution.cost, best.cost)
        model = candidate_model(strategy, (name,), below)
        models += [model] if model else []
    return tuple(models)


def candidate_model(strategy: Strategy, effects: Sequence[str], below: float = inf) -> CandidateModel | None:
    """Refit with these effects and test the residual.

    None where the refit fails, an effect exceeds its range, its amplitude significantly has an impossible sign, or the
    fit ends early because it predicts no cost ``below`` the one given.
    """
    model, fitted = strategy.model, strategy.fitted(effects, below)
    if fitted is None or any(_wrong_sign(model, fitted, e) for e in effects):
        return None
    candidates, profiles = model.setup.candidates, model.setup.free_profiles
    found = model.scores(fitted, [*candidates, *profiles])
    others = [n for n in candidates if n not in effects and is_testable(model, found, n)]
    strongest = found.strongest([*others, *profiles])
    explained = _explained(strategy, fitted)
    share = inf
    if strongest and explained > 0:
        left = max(found.statistic[strongest] - found.rank[strongest], 0.0)
        share = sqrt(left / (explained + left))
    on = {law for e in effects for law in model.by_name[e].on}
    within = strongest is not None and not on.isdisjoint(model.by_name[strongest].on)
    corrected = [model.by_name[e] for e in effects]
    return CandidateModel(
        effects=tuple(effects),
        fitted=fitted,
        residual_p=p_value(model, fitted, found, others),
        residual_like=strongest,
        residual_share=share,
        residual_in_part=within,
        unphysical=_unphysical(model, fitted),
        sensor_fault=all(e.sensor for e in corrected) and any(e.faulty for e in corrected),
    )


def _unphysical(model: FullModel, fitted: FittedModel) -> str:
    """The first parameter of the baseline that is significantly outside its physical range."""
    for u in model.regression.shared:
        if u.physical is not None and u.name in fitted.solution.values:
            value, margin = fitted.values[u.name], POLICY.needed_t * fitted.solution.std[u.name]
            if not u.physical[0] - margin <= value <= u.physical[1] + margin:
                return u.name
    return ""


def _explained(strategy: Strategy, fitted: FittedModel) -> float:
    """The misfit that a fit explains, 2 d(log likelihood).

    Where the baseline is far off, its linearized fit is no measure of its misfit. Then the whitened squares of the fit
    are scaled by the ratio of the squared errors of the main channel, baseline over fit.
    """
    setup = strategy.model.setup
    if setup.coarse_error is not None and fitted.effects:
        return 2 * fitted.solution.cost * (setup.coarse_error(NO_EFFECTS) / max(rms_of(fitted.runs), 1e-12)) ** 2
    return _gained(strategy, fitted)


def _gained(strategy: Strategy, fitted: FittedModel) -> float:
    """Twice the log likelihood that a fit gains over the baseline's, with the same noise."""
    return 2 * (strategy.base.solution.cost - fitted.solution.cost)


def _wrong_sign(model: FullModel, fitted: FittedModel, name: str) -> bool:
    """Whether the amplitude is significantly on the side of zero that its range includes only for noise."""
    effect = model.setup.candidates.get(name)
    if effect is None or len(model.amplitudes(name)) > 1:
        return False
    unknown = model.amplitudes(name)[0]
    range_, value = effect.unknowns[unknown], fitted.values[unknown]
    small, large = sorted((range_.lower, range_.upper), key=abs)
    one_sided = range_.lower < 0 < range_.upper and abs(small) < POLICY.one_sided_share * abs(large)
    return one_sided and value * small > 0 and abs(value) > POLICY.needed_t * fitted.solution.std[unknown]


def pairs(strategy: Strategy, tried: Sequence[CandidateModel], found: Detection) -> tuple[CandidateModel, ...]:
    """Candidate models of two effects that are both needed, and of single effects to which a pair adds nothing.

    Such a single effect may be untried so far: where the baseline is far off, the score of the true effect may be low.
    Fits of pairs that are hopeless beside the best single effect or profile end early.
    """
    model = strategy.model
    evidence = {n: found.scores.evidence[n] for n in found.testable}
    for one in tried:
        beside = model.scores(one.fitted, list(model.setup.candidates))
        for name in (n for n in beside.names if is_testable(model, beside, n)):
            evidence[name] = max(evidence.get(name, 0.0), beside.evidence[name])
    latencies = {n: t.fitted for t in tried for n in t.effects if strategy.nonlinear and model.by_name[n].latency}
    evidence |= {n: max(evidence[n], sqrt(max(_gained(strategy, fit), 0.0))) for n, fit in latencies.items()}
    names = sorted((n for n in evidence if evidence[n] > POLICY.pair_evidence), key=lambda n: -evidence[n])
    made = [t.fitted for t in tried] + [
        f for n in model.setup.free_profiles if (f := strategy.fitted((n,))) is not None
    ]
    least = min((f.solution.cost for f in made), default=inf)
    below = hopeless_cost(strategy.base.solution.cost, least)
    best = _best_pairs(strategy, names[: POLICY.pair_pool], latencies)
    models = [candidate_model(strategy, p, below) for p in best]
    both = [m for m in models if m is not None]
    already = {t.effects for t in tried}
    alone = dict.fromkeys(
        (e,) for m in both for e, other in permutations(m.effects) if not _is_needed(strategy, m, other)
    )
    enough = [candidate_model(strategy, e) for e in alone if e not in already]
    return (*filter(None, enough), *(m for m in both if all_needed(strategy, m)))


def _best_pairs(
    strategy: Strategy, names: Sequence[str], latencies: Mapping[str, FittedModel]
) -> list[tuple[str, str]]:
    """The pairs that explain most to first order; only these are refitted.

    Those with a latency to first order about its fit in ``latencies``: the baseline says little about a large one.
    """
    model, base = strategy.model, strategy.base
    explained: dict[tuple[str, str], float] = {}
    for first, second in combinations(names, 2):
        about = next((n for n in (first, second) if n in latencies), None)
        one, other = (first, second) if about is None else (about, second if about == first else first)
        alone = model.scores(base, [one])
        at = base if about is None else latencies[about]
        gained = alone.statistic[one] if about is None else _gained(strategy, at)
        beside = scores(at.system, [*model.base_unknowns, *model.amplitudes(one)], {other: model.amplitudes(other)})
        explained[first, second] = float(
            equivalent(gained + beside.statistic[other], alone.rank[one] + beside.rank[other])
        )
    return sorted(explained, key=lambda pair: -explained[pair])[: POLICY.pairs_refitted]


def forward_selection(
    strategy: Strategy, singles_tried: Sequence[CandidateModel], found: Detection
) -> tuple[CandidateModel, ...]:
    """Stepwise selection: add the effect with the strongest evidence in the residual until none is significant.

    It begins with a latency among ``singles_tried`` that fits better than all others, else with the strongest effect
    that can be fitted alone: of several late channels, that with the largest evidence may not change the main channel.
    After each addition, the strategy is linearized about the fit, since a further effect may seem to explain the error
    of a linear fit; and effects that are no longer needed are dropped, since the first may only imitate several others.

    For logs of real cars, in which more than two effects are present. Each effect must be needed beside all the others.

    Returns
    -------
    The selected candidate model and its ``alternatives``; empty where an effect is not needed, or the selection does
    not end within ``POLICY.most_effects``.
    """
    evidence = found.scores.evidence
    names = sorted((n for n in found.testable if evidence[n] > POLICY.single_evidence), key=lambda n: -evidence[n])
    best = best_fit(singles_tried)
    if best is not None and strategy.nonlinear and strategy.model.by_name[best.effects[0]].latency:
        tried: CandidateModel | None = best
    else:
        tried = next((one for n in names if (one := candidate_model(strategy, (n,)))), None)
    before: set[frozenset[str]] = set()
    while tried is not None and not tried.sufficient and frozenset(tried.effects) not in before:
        before.add(frozenset(tried.effects))
        more = len(tried.effects) < POLICY.most_effects and not catalog_falls_short(strategy, tried)
        further = with_next(strategy, tried) if more else None
        strategy = strategy.about(further.fitted) if further else strategy
        tried = _without_imitators(strategy, further.effects) if further else None
    if tried is None or not tried.sufficient or len(tried.effects) == 1 or not all_needed(strategy, tried):
        return ()
    return (tried, *alternatives(strategy, tried, found))


def _without_imitators(strategy: Strategy, effects: Sequence[str]) -> CandidateModel | None:
    """The candidate model without the effects before the last one that are not needed beside the others."""
    tried = candidate_model(strategy, effects)
    for effect in effects[:-1]:
        if tried is not None and not _is_needed(strategy, tried, effect):
            tried = candidate_model(strategy, [e for e in tried.effects if e != effect]) or tried
    return tried


def catalog_falls_short(strategy: Strategy, tried: CandidateModel) -> bool:
    """Whether all candidates together leave much of the misfit, so that no set of them suffices.

    To first order about the fit ``tried``: what a free profile would explain beside all candidates.
    """
    model = strategy.model
    candidates, profiles = model.setup.candidates, model.setup.free_profiles
    others = [n for n in candidates if n not in tried.effects]
    fitted, amplitudes = model.fitted_unknowns(tried.effects), [a for n in others for a in model.amplitudes(n)]
    system = tried.fitted.system
    beside = scores(system, [*fitted, *amplitudes], {n: model.amplitudes(n) for n in profiles})
    strongest = beside.strongest()
    if strongest is None or beside.evidence[strongest] < POLICY.large_t:
        return False
    left = beside.statistic[strongest] - beside.rank[strongest]
    together = scores(system, fitted, {"": amplitudes})
    explained = max(_explained(strategy, tried.fitted), 0.0) + together.statistic[""]
    return left > (1 - POLICY.part_squares) * (explained + left)


def with_next(strategy: Strategy, tried: CandidateModel) -> CandidateModel | None:
    """The candidate model with the strongest further effect whose refit succeeds; None where none is significant."""
    beside = strategy.model.scores(tried.fitted, list(strategy.model.setup.candidates))
    shown = [n for n in beside.names if beside.evidence[n] >= POLICY.needed_t]
    for name in sorted(shown, key=lambda n: -beside.evidence[n]):
        if is_testable(strategy.model, beside, name):
            found = candidate_model(strategy, (*tried.effects, name))
            if found is not None:
                return found
    return None


def alternatives(strategy: Strategy, answer: CandidateModel, found: Detection) -> tuple[CandidateModel, ...]:
    """Candidate models that differ from the answer in one effect and are not significantly worse.

    They need not suffice: of two equally likely sets of many effects, chance decides which one passes that test.
    """
    result = []
    for effect in answer.effects:
        others = tuple(e for e in answer.effects if e != effect)
        without = strategy.fitted(others)
        if without is None:
            continue
        beside = strategy.model.scores(without, [*found.testable, effect]).statistic
        latent, gained = _latencies(strategy), 2 * (without.solution.cost - answer.cost)
        for rival in found.testable:
            at_zero = effect not in latent or rival in latent  # a score at zero says little about a latency
            most = beside[effect] if at_zero else gained
            if rival in answer.effects or most - beside[rival] > POLICY.needed_t**2:
                continue
            tried = candidate_model(strategy, (*others, rival))
            if tried is None or tried.unphysical or not all_needed(strategy, tried):
                continue
            if 2 * (tried.cost - answer.cost) <= POLICY.needed_t**2:
                result.append(tried)
    return tuple(result)


def _latencies(strategy: Strategy) -> frozenset[str]:
    """The candidates about which a score at zero says little: latencies, where a fit simulates."""
    candidates = strategy.model.setup.candidates
    return frozenset(n for n, e in candidates.items() if strategy.nonlinear and e.latency)


def all_needed(strategy: Strategy, tried: CandidateModel) -> bool:
    """Whether each effect of a candidate model is significant beside the others."""
    return all(_is_needed(strategy, tried, e) for e in tried.effects)


def _is_needed(strategy: Strategy, tried: CandidateModel, effect: str) -> bool:
    """Whether the effect is significant beside the others of a candidate model."""
    without = strategy.fitted([e for e in tried.effects if e != effect])
    if without is None:  # the others would have to exceed their plausible range
        solution, names = tried.fitted.solution, strategy.model.amplitudes(effect)
        return any(abs(solution.values[n]) > POLICY.needed_t * solution.std[n] for n in names)
    if effect in _latencies(strategy):
        return 2 * (without.solution.cost - tried.cost) > POLICY.needed_t**2
    return strategy.model.scores(without, [effect]).statistic[effect] > POLICY.needed_t**2
