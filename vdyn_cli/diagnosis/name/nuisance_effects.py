"""Sensor errors that the baseline contains as nuisance parameters, such as the latency of a logger: do they matter?

A nuisance parameter with a prior stands for the effects that cover it (``Effect.covers``), so that these are not
mistaken for others. Predictions at prior values keep it at its prior mean. If its estimate changes them by more than
the limit, the effects are named, alone or beside the answer; else a note states them. A note also states an estimate
within the range that is expected of the logger (``Unknown.expected``).
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


def with_nuisance_effects(strategy: Strategy, judgment: Judgment, limits: Limits) -> Judgment:
    """The judgment with the sensor errors that the baseline contains: named where they matter, else as a note.

    Only where predictions keep prior values; other steps publish fitted values, which include these errors.
    """
    if not strategy.prior_values or not (judgment.answers or judgment.verdict == "adequate"):
        return judgment
    several = len(judgment.answers) > 1
    if several and (judgment.size is None or not judgment.size.change <= limits.noise):
        return judgment  # latencies change predictions by less
    fitted = judgment.answers[0].fitted if judgment.answers else judgment.base
    tried = _covering(strategy, fitted)
    if not tried:
        return judgment
    answers = not_significantly_worse(strategy.model, tried) or (min(tried, key=lambda t: t.cost),)
    best = min(answers, key=lambda t: (_amplitude(strategy.model, t)[0] < 0.0, t.cost))  # loggers are late, not early
    if judgment.answers and all(_is_idle_beside(strategy, a, best.effects[-1], limits) for a in judgment.answers):
        without = replace(judgment, accepted=(), material=False, closest=judgment.answers[0])
        return with_nuisance_effects(strategy, without, limits)
    if several:
        return judgment
    if (most := _expected(strategy.model, best, fitted)) > 0.0:
        by_name = strategy.model.by_name  # the note tells of the held channel: its delay covers the fewest parameters
        kept = min(
            answers,
            key=lambda t: (_amplitude(strategy.model, t)[0] < 0.0, len(by_name[t.effects[-1]].covers), t.cost),
        )
        return replace(judgment, nuisance=NuisanceError(kept, most))
    # The error need not matter more than the least of the answers that these data cannot discriminate does.
    size = min((finding_size(strategy, fitted, one.fitted) for one in answers), key=lambda one: one.change)
    matters = size.plain and size.change > limits.output
    if matters and not judgment.answers:
        chance = erfc(max(_deviation(strategy.model, t) for t in tried) / sqrt(2.0))
        return _named_alone(replace(judgment, tried=(*judgment.tried, *tried), size=size), answers, chance)
    named = _named_beside(strategy, judgment, best) if matters else None
    return named or replace(judgment, nuisance=NuisanceError(best))


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
    likely = [m for m in models if m is not None and _deviation(model, m) > POLICY.needed_t]
    # Each about its own fit: a torque that steps is far from linear in a delay, and the baseline has none of it.
    solutions = [strategy.relinearized(m.fitted).solution for m in likely]
    exact = [replace(m, fitted=replace(m.fitted, solution=s)) for m, s in zip(likely, solutions, strict=True)]
    return [m for m in exact if not may_be_zero(model, m.fitted)]


def _changes_main_channel(model: FullModel, fitted: FittedModel, effect: str) -> bool:
    """Whether the main channel, as predicted, depends on an effect's amplitudes; True where it is not known apart."""
    shared = [u.name for u in fitted.runs.regression.shared]
    columns = [shared.index(n) for n in model.amplitudes(effect) if n in shared]
    return any(r.plain is None or bool(r.plain[1][:, columns].any()) for r in fitted.runs.rows)


def _expected(model: FullModel, one: CandidateModel, without: FittedModel) -> float:
    """The largest expected size of the nuisance parameters that the last effect covers; 0 if one lies beyond its range.

    The estimates are those of the fit ``without`` the effect, and lie beyond where chance does not explain it.
    """
    covers, solution = model.by_name[one.effects[-1]].covers, without.solution
    most = 0.0
    for u in model.regression.shared:
        if u.name in covers and u.name in solution.values:
            low, high = u.expected or (0.0, 0.0)
            value, std = solution.values[u.name], solution.std[u.name]
            if max(low - value, value - high) > POLICY.needed_t * std:
                return 0.0
            most = max(most, -low, high)
    return most


def _deviation(model: FullModel, one: CandidateModel) -> float:
    """The amplitude of the last effect, in standard errors."""
    value, std = _amplitude(model, one)
    return abs(value) / std if std > 0.0 else 0.0


def _amplitude(model: FullModel, one: CandidateModel) -> tuple[float, float]:
    """The amplitude of the last effect, and its standard error."""
    name, solution = model.amplitudes(one.effects[-1])[0], one.fitted.solution
    return solution.values[name], solution.std[name]
