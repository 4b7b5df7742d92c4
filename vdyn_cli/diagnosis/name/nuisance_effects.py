"""Sensor errors that the baseline contains as nuisance parameters, such as the latency of a logger: do they matter?

A nuisance parameter with a prior stands for the effects that cover it (``Effect.covers``), so that these are not
mistaken for others. Predictions at prior values keep it at its prior mean. If its estimate changes them by more than
the limit, the effects are named, alone or beside the answer; else a note states them. A note also states an estimate
within the 95 % interval of its prior, as every logger may have it, unless it certainly improves the prediction of
held-out runs: the fit corrects it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import erfc, sqrt

from vdyn_cli.diagnosis.gain.held_out_gain import held_out_gain
from vdyn_cli.diagnosis.judgment import Judgment, NuisanceError
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel, candidate_model
from vdyn_cli.diagnosis.name.model_selection import may_be_zero, not_significantly_worse
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.size.finding_size import Limits, finding_size
from vdyn_cli.diagnosis.strategies.full_model import FittedModel, FullModel
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.quantities.constants import NORMAL95


def with_nuisance_effects(strategy: Strategy, judgment: Judgment, limits: Limits) -> Judgment:
    """The judgment with the sensor errors that the baseline contains: named where they matter, else as a note.

    Only where predictions keep prior values; other steps publish fitted values, which include these errors.
    """
    if not strategy.prior_values or not (judgment.answers or judgment.verdict == "adequate"):
        return judgment
    several = len(judgment.answers) > 1
    if several and (judgment.size is None or not judgment.size.change <= limits.noise):
        return _named_beside_each(strategy, judgment, limits)  # latencies change predictions by less than the answers
    fitted = judgment.answers[0].fitted if judgment.answers else judgment.base
    tried = _covering(strategy, fitted)
    if not tried:
        return judgment
    answers, best = _likeliest(strategy, tried)
    if judgment.answers and all(_is_idle_beside(strategy, a, best.effects[-1], limits) for a in judgment.answers):
        without = replace(judgment, accepted=(), material=False, closest=judgment.answers[0])
        return with_nuisance_effects(strategy, without, limits)
    if several:
        return judgment
    # The error need not matter more than the least of the answers that these data cannot discriminate does.
    size = min((finding_size(strategy, fitted, one.fitted) for one in answers), key=lambda one: one.change)
    matters = size.plain and size.change > limits.output
    if matters and (most := _usual(strategy, best, fitted, limits)) > 0.0:
        return replace(judgment, nuisance=NuisanceError(best, most))
    if matters and not judgment.answers:
        chance = erfc(max(_deviation(strategy.model, t) for t in tried) / sqrt(2.0))
        return _named_alone(replace(judgment, tried=(*judgment.tried, *tried), size=size), answers, chance)
    named = _named_beside(strategy, judgment, best) if matters else None
    return named or replace(judgment, nuisance=NuisanceError(best))


def _likeliest(
    strategy: Strategy, tried: Sequence[CandidateModel]
) -> tuple[tuple[CandidateModel, ...], CandidateModel]:
    """The sensor errors that fit as well as the best of those tried, and the one of them to name."""
    answers = not_significantly_worse(strategy.model, tried) or (min(tried, key=lambda t: t.cost),)
    return answers, min(answers, key=lambda t: (_amplitude(strategy.model, t)[0] < 0.0, t.cost))  # late, not early


def _named_beside_each(strategy: Strategy, judgment: Judgment, limits: Limits) -> Judgment:
    """The judgment with a sensor error beside each of several answers, if it is significant and matters beside all.

    The answers cannot be discriminated, but the error is none of them: a torque is late, whatever its gain.
    """
    first = judgment.answers[0].fitted
    tried = _covering(strategy, first)
    if not tried:
        return judgment
    _, best = _likeliest(strategy, tried)
    size = finding_size(strategy, first, best.fitted)
    if not (size.plain and size.change > limits.output) or _usual(strategy, best, first, limits) > 0.0:
        return judgment
    errors = best.effects[len(first.effects) :]
    each = [candidate_model(strategy, (*a.effects, *errors)) for a in judgment.answers]
    sure = [m for m in each if m is not None and _deviation(strategy.model, m) > POLICY.needed_t]
    if len(sure) < len(each):
        return judgment
    return replace(judgment, accepted=tuple(sure), tried=(*judgment.tried, *sure))


def _named_alone(judgment: Judgment, answers: Sequence[CandidateModel], chance: float) -> Judgment:
    """The judgment with sensor errors as the only answers; ``chance`` is the p value of the most significant one."""
    found = judgment.detection
    found = replace(found, p_value=min(found.p_value, max(chance, found.scores.smallest_p())))
    accepted = tuple(replace(a, residual_immaterial=judgment.material is False) for a in answers)
    return replace(judgment, accepted=accepted, detection=found, material=True, closest=None)


def _named_beside(strategy: Strategy, judgment: Judgment, best: CandidateModel) -> Judgment | None:
    """The judgment with the answer extended by a sensor error; None where held-out runs are not predicted better."""
    gain = held_out_gain(strategy, judgment.base, best.fitted)
    if gain is not None and (gain.worse or not gain.positive):
        return None
    size = finding_size(strategy, judgment.base, best.fitted)
    return replace(judgment, accepted=(best,), tried=(*judgment.tried, best), gain=gain, size=size)


def _is_idle_beside(strategy: Strategy, answer: CandidateModel, error: str, limits: Limits) -> bool:
    """Whether an answer changes the main output by no more than the limit, and all by less than noise, beside an error.

    It then stood for that error: slip of 1 % for a torque 50 ms late.
    """
    alone, both = (candidate_model(strategy, effects) for effects in ((error,), (*answer.effects, error)))
    if alone is None or both is None:
        return False
    size = finding_size(strategy, strategy.relinearized(alone.fitted), both.fitted)
    return size.plain and size.change <= limits.output and size.every < POLICY.idle_noise


def _covering(strategy: Strategy, fitted: FittedModel) -> list[CandidateModel]:
    """The models with one more sensor effect that stands for nuisance parameters and is significant in their place.

    Without effects that leave the predicted main channel as it is, such as the delay of another channel, and without
    those beside which another effect is no longer significant: they are alternatives of that effect.
    """
    model = strategy.model
    nuisances = model.nuisances & set(model.base_unknowns)
    names = [
        e.name
        for e in model.setup.effects
        if e.sensor and nuisances & set(e.covers) and _changes_main_channel(model, fitted, e.name)
    ]
    models = [candidate_model(strategy, (*fitted.effects, n)) for n in names if n not in fitted.effects]
    likely = [_exact(strategy, m) for m in models if m is not None and _deviation(model, m) > POLICY.needed_t]
    if likely and _amplitude(model, min(likely, key=lambda m: m.cost))[0] < 0.0:
        likely += _later_than_each(strategy, fitted, likely)
    return [m for m in likely if not may_be_zero(model, m.fitted)]


def _exact(strategy: Strategy, one: CandidateModel) -> CandidateModel:
    """A model about its own fit: a torque that steps is far from linear in a delay, and the baseline has none of it."""
    return replace(one, fitted=replace(one.fitted, solution=strategy.relinearized(one.fitted).solution))


def _later_than_each(strategy: Strategy, fitted: FittedModel, early: Sequence[CandidateModel]) -> list[CandidateModel]:
    """Models in which one channel is late against all others, and one of those is late by less.

    Loggers are late, not early: speed and acceleration that seem early by 0.15 and 0.12 s show a torque that is 0.15 s
    late, and an acceleration that is 0.03 s late.
    """
    model = strategy.model
    found = []
    for wide in {m.effects[-1] for m in early if _amplitude(model, m)[0] > 0.0}:
        covers = set(model.by_name[wide].covers)
        for other in (e for e in model.setup.effects if e.sensor and e.covers and set(e.covers) < covers):
            linear = candidate_model(strategy, (*fitted.effects, other.name, wide))
            both = _exact(strategy, linear) if linear else None
            values = both.fitted.solution.values if both else {}
            late = all(values.get(model.amplitudes(e)[0], 0.0) > 0.0 for e in (other.name, wide))
            if both and late and _deviation(model, both) > POLICY.needed_t:
                found.append(both)
    return found


def _changes_main_channel(model: FullModel, fitted: FittedModel, effect: str) -> bool:
    """Whether the main channel, as predicted, depends on an effect's amplitudes; True where it is not known apart."""
    shared = [u.name for u in fitted.runs.regression.shared]
    columns = [shared.index(n) for n in model.amplitudes(effect) if n in shared]
    return any(r.plain is None or bool(r.plain[1][:, columns].any()) for r in fitted.runs.rows)


def _usual(strategy: Strategy, one: CandidateModel, without: FittedModel, limits: Limits) -> float:
    """The largest size of an error that every logger may have; 0 if its estimate lies beyond, or is a finding.

    It is a finding if the description states what matters, or if held-out runs are certainly predicted better.
    """
    most = 0.0 if limits.stated else _within_prior(strategy.model, one, without)
    gain = held_out_gain(strategy, without, one.fitted) if most > 0.0 else None
    return 0.0 if gain is not None and gain.better else most


def _within_prior(model: FullModel, one: CandidateModel, without: FittedModel) -> float:
    """The largest size in the 95 % priors of the parameters that the last effect covers; 0 if one lies beyond its own.

    The estimates are those of the fit ``without`` the effect, and lie beyond where chance does not explain it.
    """
    covers, solution = model.by_name[one.effects[-1]].covers, without.solution
    most = 0.0
    for u in model.regression.shared:
        if u.name in covers and u.name in solution.values:
            mean, spread = u.prior or (0.0, 0.0)
            if abs(solution.values[u.name] - mean) - NORMAL95 * spread > POLICY.needed_t * solution.std[u.name]:
                return 0.0
            most = max(most, abs(mean) + NORMAL95 * spread)
    return most


def _deviation(model: FullModel, one: CandidateModel) -> float:
    """The amplitude of the last effect, in standard errors."""
    value, std = _amplitude(model, one)
    return abs(value) / std if std > 0.0 else 0.0


def _amplitude(model: FullModel, one: CandidateModel) -> tuple[float, float]:
    """The amplitude of the last effect, and its standard error."""
    name, solution = model.amplitudes(one.effects[-1])[0], one.fitted.solution
    return solution.values[name], solution.std[name]
