"""What to drive next: how far apart rival causes would be, from the Cramer-Rao bound of more runs of the same kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, sqrt

from vdyn_cli.diagnosis.scores import scores
from vdyn_cli.diagnosis.verdict import Verdict
from vdyn_cli.diagnosis.workbench import Workbench

SAFE = 6.0  # standard errors apart at which a name is safe
MOST = 200  # runs: beyond, another manoeuvre is needed
SHOWN = 4


@dataclass(frozen=True)
class NextTest:
    """A manoeuvre, what it tells apart, how many standard errors apart, and with how many further runs."""

    manoeuvre: str
    separates: tuple[str, ...]
    expected_t: float | None
    runs: int | None


def next_tests(bench: Workbench, verdict: Verdict) -> tuple[NextTest, ...]:
    """For rivals, causes without a name, and causes that these data can't show."""
    if verdict.name == "ambiguous":
        return _rivals(bench, verdict)
    if verdict.name == "not_testable":
        return _missing(bench)
    if verdict.name == "unknown":
        closest = sorted(verdict.tried, key=lambda t: -t.rest)[:SHOWN]
        return tuple(_of(bench, t.causes[0], (t.causes[0],)) for t in closest)
    return tuple(_of(bench, one.effect, (one.effect,)) for one in verdict.invisible[:SHOWN])


def _rivals(bench: Workbench, verdict: Verdict) -> tuple[NextTest, ...]:
    """Each pair of rivals: how far apart they are now, and how many more runs would settle it."""
    found = []
    for i, one in enumerate(verdict.answers):
        for other in verdict.answers[i + 1 :]:
            if len(one.causes) > 1 or len(other.causes) > 1:
                continue
            a, b = one.causes[0], other.causes[0]
            # With the rival in, what would still be seen of the cause at its size.
            apart = max(_apart(bench, a, b), _apart(bench, b, a))
            runs = len(bench.full.runs)
            more = ceil(runs * ((SAFE / apart) ** 2 - 1)) if apart > 0 else MOST + 1
            if 0 < more <= MOST:
                manoeuvre = f"{more} more {bench.case.repeated}s of the same kind"
                found.append(NextTest(manoeuvre, (a, b), round(apart * sqrt(1 + more / runs), 1), more))
            found.append(_of(bench, a, (a, b)))
    return tuple(found[:SHOWN])


def _apart(bench: Workbench, cause: str, rival: str) -> float:
    """Standard errors that a cause of the size found stands out by beside its rival."""
    fitted = bench.fitted((cause,))
    if fitted is None:
        return 0.0
    base = bench.fitted(())
    assert base is not None
    size = fitted.values[bench.unknowns(cause)[0]]
    seen = scores(base.sheet, [*bench.base, *bench.unknowns(rival)], {cause: bench.unknowns(cause)})
    spread = float(seen.spread[cause][0])
    return abs(size) / spread if spread > 0 else 0.0


def _of(bench: Workbench, cause: str, separates: Sequence[str]) -> NextTest:
    effect = bench.case.causes[cause]
    return NextTest(effect.confirm or f"a test in which {effect.label} alone changes", tuple(separates), None, None)


def _missing(bench: Workbench) -> tuple[NextTest, ...]:
    case = bench.case
    runs = len(bench.full.runs)
    wanted = max(8, case.fewest_runs)
    if case.one_way:
        what = f"{wanted} {case.repeated}s in pairs, out and back, over the same road"
        turning = tuple(e.name for e in case.effects if e.name in ("headwind", "road_grade"))
        return (NextTest(what, turning, None, wanted),)
    return (
        NextTest(f"{wanted} {case.repeated}s instead of {runs}, each as long as the track allows", (), None, wanted),
    )
