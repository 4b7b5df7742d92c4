"""Coast-downs on days as they are: names, coverage and widths, class by class.

    python -m tests.bench.messy_days [cases] [processes]

writes tests/bench/messy_days.md. The seeds are those of the published table; development used others.
"""

from __future__ import annotations

import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from subprocess import run as execute

import numpy as np

from tests.messy_cases import diagnosed_case, estimated
from tests.plant import messy_day
from vdyn_cli.quantities.result import Result

FIRST_SEED = 7_000
QUANTITIES = ("rolling_resistance", "drag_area", "road_load_60")
RATES = (1.0, 2.0, 10.0, 100.0)  # Hz
TABLE = Path(__file__).with_suffix(".md")


@dataclass(frozen=True)
class Row:
    """What came of one case: verdict, named causes, distance to the truth in half-widths, half-widths as shares.

    ``possible``: effects of the sets that an ambiguous verdict leaves open.
    """

    kind: str
    position: bool
    verdict: str
    causes: tuple[str, ...]
    off: tuple[float, ...] = ()
    width: tuple[float, ...] = ()
    seconds: float = 0.0
    possible: tuple[str, ...] = ()


def intervals(result: Result) -> dict[str, tuple[float, float]]:
    """Value and half-width of the three quantities."""
    found = {}
    for name in QUANTITIES[:2]:
        low, high = result.parameters[name].interval95
        found[name] = (0.5 * (low + high), 0.5 * (high - low))
    at = next(f for f in result.extra["road_load"]["force"] if abs(f["speed_kmh"] - 60.0) < 1e-6)
    low, high = at["interval95"]
    found[QUANTITIES[2]] = (0.5 * (low + high), 0.5 * (high - low))
    return found


def case_row(job: tuple[str, int, bool]) -> Row:
    """One case of a class through estimate and diagnosis."""
    kind, seed, position = job
    case = messy_day.drive(seed, messy_day.drawn_day(kind, seed))
    begin = time.perf_counter()
    try:
        result = diagnosed_case(case, position)
    except Exception as error:  # a case that fails is a row of the table
        return Row(kind, position, f"failed: {str(error)[:60]}", ())
    spent = time.perf_counter() - begin
    assert result.diagnosis is not None
    found, truth = intervals(result), case.truth
    off = tuple((found[n][0] - truth[n]) / found[n][1] for n in QUANTITIES)
    width = tuple(found[n][1] / truth[n] for n in QUANTITIES)
    causes = tuple(c.effect for c in result.diagnosis.causes)
    possible = tuple(e for some in result.diagnosis.ambiguous for e in some)
    return Row(kind, position, result.diagnosis.verdict, causes, off, width, spent, possible)


def agreement(job: tuple[int, str]) -> tuple[int, int]:
    """Pairs of answers within each other's intervals, and all pairs: one day at several rates, gusts and white."""
    seed, waves = job
    day = replace(messy_day.drawn_day("undulating", seed), rms=5e-4, waves=waves)
    answers = []
    for rate in RATES:
        logger = replace(day.logger, rate=rate)
        answers.append(intervals(estimated(messy_day.drive(seed, replace(day, logger=logger)), position=False)))
    white = messy_day.drive(seed, replace(day, logger=replace(day.logger, rate=RATES[2])))
    answers.append(intervals(estimated(white, position=False, noise="white")))
    pairs = [(a, b, n) for i, a in enumerate(answers) for b in answers[:i] for n in QUANTITIES]
    return sum(abs(a[n][0] - b[n][0]) <= max(a[n][1], b[n][1]) for a, b, n in pairs), len(pairs)


def right(row: Row) -> bool:
    """Whether only what is there was named: the road with position, a brake's drag, the delay of a filtered speed."""
    allowed = {"grade_profile"} if row.position else set()
    allowed |= {"fading": {"brake_drag_fading"}, "filtered": {"speed_delay"}}.get(row.kind, set())
    return row.verdict not in ("named", "data_fault") or set(row.causes) <= allowed


def table(rows: list[Row], agreed: tuple[int, int]) -> str:
    """The page."""
    commit = execute(
        ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False
    ).stdout.strip()
    head = (
        "# Messy days\n\nWritten by `python -m tests.bench.messy_days` at commit "
        f"{commit}. Coast-downs of random vehicles on days drawn by `tests/plant/messy_day.py`, as many as a row says: "
        "roads of 0.05 to 0.3 % rms (to 0.1 % beside another nuisance), 8 runs, gusts of 0.5 m/s, drift of 0.3 m/s. "
        "*Covered*: 95 % intervals that hold the truth, of rolling resistance, drag area and road load at 60 km/h; "
        "*width*: median half-width. Wanted: false names at most 5 %, covered at least 92 % with position and 90 % "
        "without, a fading brake found at least in 80 % with position (named + in the set of an ambiguous verdict).\n\n"
        "| class | position | cases | failed | false names | adequate | unknown | brake found | covered | width | s |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|\n"
    )
    lines = []
    for kind in messy_day.CLASSES:
        for position in (True, False):
            mine = [r for r in rows if r.kind == kind and r.position == position]
            good = [r for r in mine if r.off]
            if not good:
                lines.append(f"| {kind} | {'yes' if position else 'no'} | {len(mine)} | {len(mine)} | | | | | | | |")
                continue
            n = len(good)
            covered = " / ".join(str(sum(abs(r.off[i]) <= 1 for r in good)) for i in range(3))
            width = " / ".join(f"{100 * np.median([r.width[i] for r in good]):.1f} %" for i in range(3))
            named = sum("brake_drag_fading" in r.causes for r in good)
            held = sum("brake_drag_fading" in r.possible for r in good)
            brake = f"{named} + {held}" if kind == "fading" else ""
            verdicts = [r.verdict for r in good]
            lines.append(
                f"| {kind} | {'yes' if position else 'no'} | {len(mine)} | {len(mine) - n} | "
                f"{sum(not right(r) for r in good)} | {verdicts.count('adequate')} | {verdicts.count('unknown')} | "
                f"{brake} | {covered} | {width} | {np.median([r.seconds for r in good]):.1f} |"
            )
    tail = (
        f"\n\nThe same days (0.05 % rms, without position) at {', '.join(f'{r:g}' for r in RATES)} Hz and with plain "
        f"least squares: {agreed[0]} of {agreed[1]} pairs of answers lie within each other's wider interval.\n"
    )
    return head + "\n".join(lines) + tail


def main(cases: int = 50, processes: int = 2) -> None:
    """Run all classes and write the table."""
    seeds = range(FIRST_SEED, FIRST_SEED + cases)
    jobs = [(k, s, p) for k in messy_day.CLASSES for s in seeds for p in (True, False)]
    days = [(s, w) for s, w in zip(seeds, ["sines", "random", "bowls"] * cases, strict=False)][: max(cases // 2, 2)]
    with ProcessPoolExecutor(processes) as pool:
        rows = list(pool.map(case_row, jobs))
        pairs = list(pool.map(agreement, days))
    TABLE.write_text(table(rows, (sum(p[0] for p in pairs), sum(p[1] for p in pairs))))


if __name__ == "__main__":
    main(*(int(v) for v in sys.argv[1:]))
