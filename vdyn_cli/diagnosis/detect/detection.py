"""Detects a model error at a false-alarm level over all tests, and decides which effects are testable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, log2
from typing import Literal

from vdyn_cli.diagnosis.detect.scores import Scores
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.effect_unknowns import largest_plausible
from vdyn_cli.diagnosis.strategies.full_model import FittedModel, FullModel
from vdyn_cli.diagnosis.strategies.linearized_system import LinearizedSystem
from vdyn_cli.diagnosis.strategies.strategy import Strategy

Obstacle = Literal["nuisance", "runs", "collinear", "noise"]


@dataclass(frozen=True)
class Detection:
    """The tests beside a fitted model.

    Parameters
    ----------
    scores : of candidates and profiles.
    testable : candidates that these data would show at a plausible amplitude.
    p_value : adjusted over the three families of tests; compare with the level.
    system : the linearized system whose units are the evidence.
    """

    scores: Scores
    testable: tuple[str, ...]
    p_value: float
    system: LinearizedSystem


def detect(strategy: Strategy, at: FittedModel) -> Detection:
    """Test all candidates and profiles beside a fitted model, which may contain effects.

    Parameters
    ----------
    strategy : gives the full model and its linearization. at : the fit beside which the scores are computed.

    Returns
    -------
    The scores, the candidates that these data can show, and the adjusted p value (``p_value``); where the baseline is
    far off, an error is certain, and p is the smallest that the units allow.
    """
    model = strategy.model
    names = [n for n in model.setup.candidates if n not in at.effects]
    scores = model.scores(at, [*names, *model.setup.free_profiles])
    testable = tuple(n for n in names if is_testable(model, scores, n))
    p = p_value(model, at, scores, testable, scaled=True)
    if model.setup.far_off and not at.effects:  # scores mean little then, and an error is certain
        p = min(p, scores.smallest_p())
    return Detection(scores, testable, p, at.system)


def p_value(model: FullModel, at: FittedModel, scores: Scores, names: Sequence[str], scaled: bool = False) -> float:
    """Probability of statistics as large, over three families of tests, if none of these effects were present.

    p = min over families of p_family / share, with the shares of the policy scaled to sum to one. Effects that vary
    between runs are tested with whole runs as units, the others and the profiles with the system's own.

    Parameters
    ----------
    at, scores : the fitted model, and the scores beside it.
    scaled : see ``Scores.p_value``.
    """
    kind = {n: model.setup.candidates[n].kind for n in names}
    within = [n for n in names if kind[n] == "within_run"]
    between = [n for n in names if kind[n] == "between_run" and _enough_runs(model)]
    profiles = [n for n in model.setup.free_profiles if scores.rank[n]]
    tests = []  # share and p value of each family
    if within:
        tests.append((POLICY.named_share, scores.p_value(within, scaled=scaled)))
    if between:
        tests.append((POLICY.named_share, model.scores(at, between, runs=True).p_value()))
    if profiles:
        tests.append((POLICY.profile_share, scores.p_value(profiles, scaled=scaled)))
    spent = sum(share for share, _ in tests)
    return min(1.0, spent * min(p / share for share, p in tests)) if tests else 1.0


def is_testable(model: FullModel, scores: Scores, name: str) -> bool:
    """Whether these data would show the candidate at a plausible amplitude.

    Parameters
    ----------
    scores : of the candidates beside a fit. name : of the candidate.
    """
    return obstacle(model, scores, name) is None


def obstacle(model: FullModel, scores: Scores, name: str) -> Obstacle | None:
    """Why these data would not show the candidate at a plausible amplitude; None where they would.

    "nuisance": a nuisance parameter of the baseline stands for it (``nuisance_effects``).

    A sensitivity that is nearly collinear with fitted unknowns is not trusted for its small remainder, unless that
    contradicts priors: a drifting sensor zero acts like a force, but exceeds the tolerance of its data sheet. Nor is an
    effect trusted that scales what has an estimated prior, as rotating mass scales the slopes of a road: smaller slopes
    are always likelier under a prior whose standard deviation was estimated from them.
    """
    if name in model.nuisance_errors:
        return "nuisance"
    if scores.rank[name] == 0 or scores.scaling[name] > POLICY.prior_information:
        return "collinear"
    if not (scores.visibility[name] > POLICY.least_visibility or scores.stated[name] > POLICY.prior_information):
        return "collinear"
    if model.setup.candidates[name].kind == "between_run" and not _enough_runs(model):
        return "runs"
    return None if reachable_t(model, scores, name) > POLICY.reachable_t else "noise"


def reachable_t(model: FullModel, scores: Scores, name: str) -> float:
    """Largest score statistic t of the candidate, in standard errors, at the edge of its range; 0 if invisible.

    Parameters
    ----------
    scores : of the candidates beside a fit. name : of the candidate.
    """
    effect = model.setup.candidates[name]
    spread: Sequence[float] = scores.spread[name].tolist()
    each = zip(model.amplitudes(name), spread, strict=True)
    return max((largest_plausible(effect, n) / s for n, s in each if s > 0), default=0.0)


def fewest_runs(level: float) -> int:
    """Least number of runs to certify an effect that varies between them: 2^(1 - runs) < its share of the level.

    Parameters
    ----------
    level : false-alarm probability of the step's diagnosis, 0 to 1.
    """
    return max(POLICY.fewest_runs_between, 1 + ceil(log2(1 / (POLICY.named_share * level))))


def _enough_runs(model: FullModel) -> bool:
    return model.run_count >= fewest_runs(model.setup.level)
