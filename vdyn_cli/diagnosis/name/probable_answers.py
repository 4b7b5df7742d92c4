"""Answers with one more effect than the published one that these data do not exclude; intervals must include them.

A named effect, or the free road of a coast-down, can hide another effect: a free road absorbs most of a brake that
releases slowly, and the parameters are biased. The score test then has little power, so that its p value means little.
The posterior probability is used instead, with the prior that one more effect is as likely as none, that all candidates
are equally likely, and that amplitudes are a ~ N(0, sigma^2):

    P_k ~ (1 / m) B_k,   P_0 ~ 1,   B_k = s / sqrt(s^2 + sigma^2) exp(a^2 sigma^2 / (2 s^2 (s^2 + sigma^2)))

with a and s the score test's estimate and standard error of candidate k of m, and sigma ``catalog_prior`` of its
plausible range, or the standard deviation with which the description states what it corrects, if that is smaller.
For an effect that every day has, such as wind (``Effect.every_day``, its sigma), 1 / m is 1: it is as likely as none.
Both forms of a law that has another (``Effect.other_law``) share the prior of their effect.
Source: Kass and Raftery, Bayes factors, J. Am. Stat. Assoc. 90 (1995) 773.
"""

from __future__ import annotations

import math
from collections.abc import Collection

from vdyn_cli.diagnosis.detect.detection import is_testable
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel, candidate_model
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.effect_unknowns import largest_plausible
from vdyn_cli.diagnosis.strategies.full_model import FittedModel
from vdyn_cli.diagnosis.strategies.strategy import Strategy


def probable_answers(
    strategy: Strategy, published: FittedModel, among: Collection[str] | None = None
) -> list[tuple[CandidateModel, float]]:
    """The candidate models with one more effect whose probability exceeds ``open_probability``, with that probability.

    Parameters
    ----------
    published : the fit of the named answer, or of the baseline. Only testable candidates of one amplitude are added,
        and none with which a parameter is significantly outside its physical range.
    among : only the answers with these effects; None for all.
    """
    model = strategy.model
    beside = model.scores(published, [n for n in model.setup.candidates if n not in published.effects])
    odds: dict[str, float] = {}
    always = {n for n in beside.names if model.setup.candidates[n].every_day}
    for name in beside.names:
        if beside.spread[name].size == 1 and is_testable(model, beside, name):
            effect = model.setup.candidates[name]
            first, std = model.amplitudes(name)[0], float(beside.spread[name][0])
            sigma = effect.every_day or POLICY.catalog_prior * largest_plausible(effect, first)
            stated = model.setup.stated.get(first, sigma)
            if std < stated:  # else the stated standard deviation, which the intervals include, is the smaller one
                odds[name] = bayes_factor(float(beside.estimate[name][0]), std, min(sigma, stated))
    count = sum(n not in always for n in odds)
    forms = {n: 1 + (model.setup.candidates[n].other_law is not None) for n in odds}
    odds = {n: factor if n in always else factor / (count * forms[n]) for n, factor in odds.items()}
    total = 1.0 + sum(odds.values())
    found: list[tuple[CandidateModel, float]] = []
    for name, factor in odds.items():
        if factor > POLICY.open_probability * total and (among is None or name in among):
            tried = candidate_model(strategy, (*published.effects, name))
            if tried is not None and not tried.unphysical:
                found.append((tried, factor / total))
    return found


def bayes_factor(estimate: float, std: float, sigma: float) -> float:
    """The Bayes factor B above: likelihood with an amplitude ~ N(0, sigma^2) over likelihood with none.

    Parameters
    ----------
    estimate, std : the amplitude by these data and its standard error, in the unit of ``sigma``.
    """
    shrunk = sigma**2 / (std**2 + sigma**2)
    return math.sqrt(1.0 - shrunk) * math.exp(min(0.5 * (estimate / std) ** 2 * shrunk, 700.0))
