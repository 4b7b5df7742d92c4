"""Naming by sufficiency: a cause is named if, with it in, nothing else of the catalogue adds anything, nor any shape.

A cause that merely makes the fit better is no answer: on a headwind's log a brake drag takes away most of the error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import inf

from vdyn_cli.diagnosis.detect import Detection, chance, is_testable
from vdyn_cli.diagnosis.scores import equivalent, scores
from vdyn_cli.diagnosis.workbench import Fitted, Workbench

REST = 0.02  # level at which something else still adds
BEYOND = 3.0  # standard errors that each of two causes must reach
LITTLE = 0.001  # of what was explained: no law is exact to more, where an effect is hundreds of standard errors large
LEAST = 1.5  # normal equivalent: what shows less by itself is not tried as the whole answer
FEWEST_SHARE = 0.25  # of the strongest evidence: what explains less is not tried alone
MOST = 5  # causes of one answer
ONE_SIDED = 0.15  # of a range that lies beyond zero: that much is there for noise alone
REFITTED = 6  # pairs
PAIRED = 8  # strongest causes of which pairs are tried


@dataclass(frozen=True)
class Trial:
    """One candidate answer.

    Parameters
    ----------
    causes : in it.
    rest : chance that what is left of the others, and of free profiles, is noise.
    strongest : what is left most, and ``left``: how much that would explain further, as a share of what was explained.
    """

    causes: tuple[str, ...]
    fitted: Fitted
    rest: float
    strongest: str | None
    left: float

    @property
    def sufficient(self) -> bool:
        return self.rest > REST

    @property
    def nearly(self) -> bool:
        """Is next to nothing left, be it noise or not?"""
        return self.left < LITTLE


def singles(bench: Workbench, detection: Detection) -> tuple[Trial, ...]:
    """Every cause that could be the whole answer, tried after its refit."""
    evidence = detection.scores.evidence
    most = max((evidence[n] for n in detection.testable), default=0.0)
    tried = []
    for name in sorted(detection.testable, key=lambda n: -evidence[n]):
        if evidence[name] < max(LEAST, FEWEST_SHARE * most):
            continue
        trial = attempt(bench, (name,))
        if trial is not None:
            tried.append(trial)
    return tuple(tried)


def attempt(bench: Workbench, causes: Sequence[str]) -> Trial | None:
    """Refit with these causes and see what is left.

    None where the refit fails, or a cause leaves its range or has a sign for sure that it cannot have.
    """
    fitted = bench.fitted(causes)
    if fitted is None or any(_upside_down(bench, fitted, c) for c in causes):
        return None
    found = bench.scores(fitted, [*bench.case.causes, *bench.case.families])
    others = [n for n in bench.case.causes if n not in causes and is_testable(bench, found, n)]
    p = chance(bench, fitted, found, others)
    strongest = found.strongest([*others, *bench.case.families])
    base = bench.fitted(())
    explained = 2 * (base.solution.cost - fitted.solution.cost) if base else 0.0
    left = found.statistic[strongest] / explained if strongest and explained > 0 else inf
    return Trial(tuple(causes), fitted, p, strongest, left)


def _upside_down(bench: Workbench, fitted: Fitted, cause: str) -> bool:
    """Is a cause for sure beyond zero, where its range goes only as far as noise may carry it?"""
    effect = bench.case.causes.get(cause)
    if effect is None or len(bench.unknowns(cause)) > 1:
        return False
    name = bench.unknowns(cause)[0]
    range_, sizes = effect.unknowns[name], fitted.solution
    thin = range_.lower if abs(range_.lower) < abs(range_.upper) else range_.upper
    one_sided = range_.lower < 0 < range_.upper and abs(thin) < ONE_SIDED * max(-range_.lower, range_.upper)
    return one_sided and sizes.values[name] * thin > 0 and abs(sizes.values[name]) > BEYOND * sizes.std[name]


def pairs(bench: Workbench, tried: Sequence[Trial], detection: Detection) -> tuple[Trial, ...]:
    """Two causes together, each of them beyond three standard errors beside the other."""
    evidence = {n: detection.scores.evidence[n] for n in detection.testable}
    for one in tried:
        beside = bench.scores(one.fitted, list(bench.case.causes))
        for name in (n for n in beside.names if is_testable(bench, beside, n)):
            evidence[name] = max(evidence.get(name, 0.0), beside.evidence[name])
    names = sorted((n for n in evidence if evidence[n] > 2.0), key=lambda n: -evidence[n])[:PAIRED]
    found = []
    for pair in _likeliest(bench, list(combinations(names, 2))):
        trial = attempt(bench, pair)
        if trial is not None and all(_beyond(bench, trial, c) for c in pair):
            found.append(trial)
    return tuple(found)


def _likeliest(bench: Workbench, tried: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """The pairs that explain most to first order: only they are refitted."""
    base = bench.fitted(())
    assert base is not None
    explained: dict[tuple[str, str], float] = {}
    for first in dict.fromkeys(a for a, _ in tried):
        alone = bench.scores(base, [first])
        rivals = [b for a, b in tried if a == first]
        beside = scores(base.sheet, [*bench.base, *bench.unknowns(first)], {b: bench.unknowns(b) for b in rivals})
        for b in rivals:
            both = alone.statistic[first] + beside.statistic[b]
            explained[first, b] = float(equivalent(both, alone.rank[first] + beside.rank[b]))
    return sorted(explained, key=lambda pair: -explained[pair])[:REFITTED]


def one_after_another(bench: Workbench, start: Detection) -> Trial | None:
    """Causes taken in one by one, each time the one that then shows most, until nothing adds any more.

    For logs of real cars, in which more than two things are wrong at once. Each cause must stay beyond three standard
    errors beside all the others; None where they do not come to an end within ``MOST``.
    """
    evidence = start.scores.evidence
    names = [n for n in start.testable if evidence[n] > LEAST]
    causes: tuple[str, ...] = tuple(sorted(names, key=lambda n: -evidence[n])[:1])
    while 0 < len(causes) <= MOST:
        trial = attempt(bench, causes)
        if trial is None:
            return None
        if trial.sufficient:
            return trial if len(causes) > 1 and all(_beyond(bench, trial, c) for c in causes) else None
        beside = bench.scores(trial.fitted, list(bench.case.causes))
        left = [n for n in beside.names if is_testable(bench, beside, n)]
        strongest = beside.strongest(left)
        if strongest is None or beside.evidence[strongest] < BEYOND:
            return None
        causes = (*causes, strongest)
    return None


def as_good(bench: Workbench, answer: Trial, start: Detection) -> tuple[Trial, ...]:
    """Answers that differ from this one in a single cause, suffice as well, and explain as much."""
    found = []
    for cause in answer.causes:
        others = tuple(c for c in answer.causes if c != cause)
        without = bench.fitted(others)
        if without is None:
            continue
        beside = bench.scores(without, [*start.testable, cause]).statistic
        for rival in start.testable:
            if rival in answer.causes or beside[cause] - beside[rival] > BEYOND**2:
                continue
            trial = attempt(bench, (*others, rival))
            if trial is None or not trial.sufficient or not all(_beyond(bench, trial, c) for c in trial.causes):
                continue
            if 2 * (trial.fitted.solution.cost - answer.fitted.solution.cost) <= BEYOND**2:
                found.append(trial)
    return tuple(found)


def _beyond(bench: Workbench, trial: Trial, cause: str) -> bool:
    """Is the cause needed beside the others of the answer?"""
    others = tuple(c for c in trial.causes if c != cause)
    without = bench.fitted(others)
    if without is None:  # without it the others would have to be more than is plausible
        solution = trial.fitted.solution
        return any(abs(solution.values[n]) > BEYOND * solution.std[n] for n in bench.unknowns(cause))
    return bench.scores(without, [cause]).statistic[cause] > BEYOND**2
