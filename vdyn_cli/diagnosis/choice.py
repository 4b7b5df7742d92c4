"""Which of the answers that were tried stands, where several would do or a profile imitates what is simpler."""

from __future__ import annotations

from collections.abc import Sequence

from scipy.stats import chi2

from vdyn_cli.diagnosis.detect import Detection
from vdyn_cli.diagnosis.naming import BEYOND, Trial
from vdyn_cli.diagnosis.workbench import Fitted, Workbench

FEW = 3  # unknowns of a cause that has one shape
SOME = 2.0  # standard errors of a cause that is named
BARELY = 0.002  # chance below which a simple cause misses too much, or a profile is better by more than luck


def not_outdone(bench: Workbench, tried: tuple[Trial, ...]) -> tuple[Trial, ...]:
    """The answers that suffice and that none of as few unknowns outdoes; what they leave need not be enough to show it.

    Twice the difference of the costs exceeds 9 by chance in at most 0.13 % of the cases in which an answer is true.
    """

    def size(trial: Trial) -> int:
        return max(FEW, *(len(bench.unknowns(c)) for c in trial.causes))

    def least(most: int) -> float:
        return min(t.fitted.solution.cost for t in tried if size(t) <= most)

    return tuple(t for t in tried if t.sufficient and _excess(t, least(size(t))) <= BEYOND**2)


def nearly(tried: Sequence[Trial]) -> tuple[Trial, ...]:
    """The answers that leave next to nothing of a large error, though more than noise; none that another outdoes."""
    near = [t for t in tried if t.nearly]
    least = min((t.fitted.solution.cost for t in tried), default=0.0)
    return tuple(t for t in near if _excess(t, least) <= BEYOND**2)


def simplest(bench: Workbench, answers: tuple[Trial, ...], tried: Sequence[Trial]) -> tuple[Trial, ...]:
    """Without causes of many unknowns where one of few will do: a profile can imitate whatever is simpler.

    It must also outdo those of few by more than its unknowns would by chance; else those that miss little are answers.
    """

    def unknowns(trial: Trial) -> int:
        return sum(len(bench.unknowns(c)) for c in trial.causes)

    simple = [t for t in tried if all(len(bench.unknowns(c)) <= FEW for c in t.causes)]
    few = tuple(t for t in answers if t in simple)
    if few or not answers:
        return few
    best = min(answers, key=lambda t: t.fitted.solution.cost)
    fewer = [t for t in simple if t.rest > BARELY and unknowns(t) < unknowns(best)]
    excess = [_excess(t, best.fitted.solution.cost) for t in fewer]
    more = [unknowns(best) - unknowns(t) for t in fewer]
    close = [t for t, e, df in zip(fewer, excess, more, strict=True) if chi2.sf(e, df) > BARELY]
    least = min((t.fitted.solution.cost for t in close), default=0.0)
    return tuple(t for t in close if _excess(t, least) <= BEYOND**2) or answers


def _excess(trial: Trial, least: float) -> float:
    """By how much the sum of squares of what it leaves exceeds that of the least cost."""
    return float(2 * (trial.fitted.solution.cost - least))


def nothing(bench: Workbench, fitted: Fitted) -> bool:
    """Could a cause of the answer as well be of no size, by how much the runs differ? Then it is not certain enough.

    Of causes of one unknown: beside a shape that is free a size is uncertain however surely there is something.
    """
    solution = fitted.solution
    one = [bench.freed(c)[0] for c in fitted.causes if len(bench.freed(c)) == 1]
    return any(abs(solution.values[n]) < SOME * solution.std[n] for n in one)


def unlisted(bench: Workbench, trial: Trial, found: Detection) -> bool:
    """Is the answer a shape of many unknowns that does no better than a free force of fewer, but for luck?"""
    cause, *others = trial.causes
    if others or len(bench.unknowns(cause)) <= FEW:
        return False
    scores = found.scores
    more = {f: scores.rank[cause] - scores.rank[f] for f in bench.case.families if scores.rank[f]}
    return any(chi2.sf(scores.statistic[cause] - scores.statistic[f], df) > BARELY for f, df in more.items() if df > 0)
