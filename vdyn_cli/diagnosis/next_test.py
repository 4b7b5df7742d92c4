"""What to drive next, and by how many standard errors it would tell: for rivals, and for causes that do not show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from math import ceil

from vdyn_cli.diagnosis.choice import FEW
from vdyn_cli.diagnosis.design import SAFE, Asked, Designer, Plan
from vdyn_cli.diagnosis.detect import FEWEST_RUNS
from vdyn_cli.diagnosis.invisible import TYPICAL
from vdyn_cli.diagnosis.naming import Trial
from vdyn_cli.diagnosis.verdict import Verdict
from vdyn_cli.diagnosis.workbench import Workbench

MOST = 200  # runs: beyond, another manoeuvre is needed
SHOWN = 4
HELPS = 1.0  # standard error: what tells less than that does not help at all
AT_TYPICAL = ", at half of the plausible range"
TURNING = ("headwind", "road_grade")  # what only runs both ways can tell


@dataclass(frozen=True)
class NextTest:
    """A manoeuvre, what it tells apart, how many standard errors apart, and with how many further runs."""

    manoeuvre: str
    separates: tuple[str, ...]
    expected_t: float | None
    runs: int | None


def next_tests(bench: Workbench, verdict: Verdict) -> tuple[NextTest, ...]:
    """For rivals, causes without a name, and causes that these data can't show; what is not reckoned comes last."""
    designer = Designer(bench)
    if verdict.name == "ambiguous":
        return _rivals(designer, list(combinations(verdict.answers, 2)))
    if verdict.name == "not_testable":
        return _missing(designer, verdict)
    if verdict.name == "unknown":
        closest = sorted(verdict.tried, key=lambda t: -t.rest)[:SHOWN]
        return _rivals(designer, list(pairwise(closest)), more=False)
    return _unseen(designer, verdict)


def _rivals(designer: Designer, pairs: Sequence[tuple[Trial, Trial]], more: bool = True) -> tuple[NextTest, ...]:
    """Each pair that differs in one cause: what would settle it, and what shows a cause without any reckoning.

    ``more``: whether more runs of the same kind are worth thinking of.
    """
    found: list[NextTest] = []
    bests: dict[tuple[str, ...], Plan | None] = {}
    for one, other in pairs:
        mine, yours = set(one.causes) - set(other.causes), set(other.causes) - set(one.causes)
        if len(mine) != 1 or len(yours) != 1 or len(bests) == SHOWN:
            continue
        a, b = *mine, *yours
        asked = _apart(designer.bench, (one, a), (other, b))
        bests[a, b] = designer.best(asked)
        found += _designed(designer, asked, (a, b), bests[a, b], more)
    causes = list(dict.fromkeys(c for pair in bests for c in pair))[:SHOWN]
    return (*found, *(_confirmed(designer.bench, c, bests) for c in causes))


def _apart(bench: Workbench, *answers: tuple[Trial, str]) -> tuple[Asked, ...]:
    """With the rival in, what would still be seen of the cause at its size: whichever of the two is there.

    A rival of many unknowns imitates any cause of few; of the two the simpler is then the answer.
    """
    found = []
    for (one, cause), (other, rival) in (answers, answers[::-1]):
        if len(bench.unknowns(rival)) <= max(FEW, len(bench.unknowns(cause))):
            sizes = {n: one.fitted.values[n] for n in bench.unknowns(cause)}
            beside = (*bench.base, *(n for c in other.causes for n in bench.unknowns(c)))
            found.append(Asked(sizes, beside))
    return tuple(found)


def _designed(
    designer: Designer, asked: Sequence[Asked], separates: Sequence[str], best: Plan | None, more: bool, of: str = ""
) -> list[NextTest]:
    """The cheapest manoeuvre that will do, or the one that tells most; more runs of the same kind where they are less.

    ``of``: which size is reckoned with, where nobody found one.
    """
    now, found = designer.now(asked), []
    if best is not None and best.t >= HELPS:
        words = f"{best.manoeuvre.words(best.runs)} (t is {now:.1f} now{of})"
        found.append(NextTest(words, tuple(separates), round(best.t, 1), best.runs))
    runs = len(designer.bench.full.runs)
    further = ceil(runs * ((SAFE / now) ** 2 - 1)) if now > 0 else MOST + 1
    cheaper = best is None or best.t < SAFE or further < best.runs
    if more and cheaper and 0 < further <= MOST:
        t = designer.more(asked, 1 + further / runs)
        words = f"{further} more {designer.bench.case.repeated}s of the same kind"
        found.append(NextTest(words, tuple(separates), round(t, 1), further))
    return found


def _unseen(designer: Designer, verdict: Verdict) -> tuple[NextTest, ...]:
    """Causes that these data can't show, those first that the fewest runs would show, were they as large as listed."""
    bench = designer.bench
    answer = verdict.answer.causes if verdict.answer else ()
    beside = (*bench.base, *(n for c in answer for n in bench.unknowns(c)))
    asked = {
        i.effect: (Asked({bench.unknowns(i.effect)[0]: i.size}, beside),)
        for i in verdict.invisible
        if i.effect not in answer
    }
    plans = {cause: designer.best(question) for cause, question in asked.items()}

    def order(cause: str) -> tuple[bool, float]:
        plan = plans[cause]
        return (True, 0.0) if plan is None else (plan.t < SAFE, plan.runs if plan.t >= SAFE else -plan.t)

    causes = sorted(asked, key=order)[:SHOWN]
    found = [t for c in causes for t in _designed(designer, asked[c], (c,), plans[c], False, AT_TYPICAL)]
    return (*found, *(_confirmed(bench, c, {(c,): plans[c]}) for c in causes))


def _confirmed(bench: Workbench, cause: str, designed: Mapping[tuple[str, ...], Plan | None]) -> NextTest:
    """What shows the cause, in its own words, and from which rivals; and whether nothing that was designed helps."""
    own = {names: best for names, best in designed.items() if cause in names}
    rivals = dict.fromkeys(n for names in own for n in names if n != cause)
    effect = bench.case.causes[cause]
    words = effect.confirm or f"a test in which {effect.label} alone changes"
    best = max((plan for plan in own.values() if plan is not None), key=lambda p: p.t, default=None)
    if best is not None and best.t < HELPS:
        words += f" No {bench.case.repeated} tells: t would be {best.t:.1f} after {best.manoeuvre.words(best.runs)}."
    return NextTest(words, (cause, *rivals), None, None)


def _missing(designer: Designer, verdict: Verdict) -> tuple[NextTest, ...]:
    """What was driven too little of; where all went one way, how far that would tell what turns with the direction."""
    case, runs = designer.bench.case, len(designer.bench.full.runs)
    if not verdict.why:  # no cause would show, however often the same is driven
        return _unseen(designer, verdict)
    wanted = max(FEWEST_RUNS, case.fewest_runs, runs if case.one_way else 2 * runs)
    if not case.one_way:
        what = f"{wanted} {case.repeated}s instead of {runs}, each as long as the track allows"
        return (NextTest(what, (), None, wanted),)
    turning = tuple(n for n in TURNING if n in case.causes)
    what = f"{wanted} {case.repeated}s in pairs, out and back, over the same road"
    first = NextTest(what, turning, None, wanted)
    if len(turning) < len(TURNING) or runs < case.fewest_runs:
        return (first,)
    asked = _typical(designer.bench, turning)
    return (first, *_designed(designer, asked, turning, designer.best(asked), False, AT_TYPICAL))


def _typical(bench: Workbench, causes: Sequence[str]) -> tuple[Asked, ...]:
    """Each of these causes, of a typical size, beside the others."""
    found = []
    for cause in causes:
        unknown = bench.unknowns(cause)[0]
        quantity = bench.case.causes[cause].unknowns[unknown]
        size = TYPICAL * max(abs(quantity.lower), abs(quantity.upper))
        others = [n for c in causes if c != cause for n in bench.unknowns(c)]
        found.append(Asked({unknown: size}, (*bench.base, *others)))
    return tuple(found)
