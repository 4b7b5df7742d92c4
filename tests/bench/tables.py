"""All tables of accuracy, of one commit: ``python -m tests.bench.tables [--cases 30] [--jobs 2] [--only NAME ...]``.

Each table is written by its own program, which the list below names; ``--cases`` vehicles a row (days, seeds) are
tried, fewer where a case takes long. tests/bench/tables.md says which commit they are of, and how long each took.
The working tree must be clean, so that the commit is what ran. Set OPENBLAS_NUM_THREADS=1.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

PAGE = Path(__file__).with_suffix(".md")
FIRST_SEED = 20_000  # of all tables that take one; development used seeds below
ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Table:
    """A table: its program, the question it answers, and its arguments for a number of cases and of processes."""

    name: str
    question: str
    arguments: Callable[[int, int], list[str]]
    parallel: bool = False
    """Whether the program starts several processes itself; others run side by side."""


def _seeds(option: str, share: int = 1) -> Callable[[int, int], list[str]]:
    return lambda cases, _: [option, str(max(1, cases // share)), "--first", str(FIRST_SEED)]


TABLES = (
    Table(
        "hidden",
        "is an effect that is hidden in the logs found, with its size and gain?",
        lambda cases, jobs: [*_seeds("--seeds")(cases, jobs), "--jobs", str(jobs), "--fresh", str(max(1, cases // 3))],
        parallel=True,
    ),
    Table(
        "verdict_intervals",
        "do intervals hold the truth where the verdict is ambiguous or unknown?",
        lambda cases, jobs: [*_seeds("--seeds", 3)(cases, jobs), "--jobs", str(jobs)],
        parallel=True,
    ),
    Table(
        "messy_days",
        "false names, coverage and widths of coast-downs on rough roads in changing wind",
        lambda cases, jobs: [str(max(2, cases // 2)), str(jobs)],
        parallel=True,
    ),
    Table(
        "diagnose_first",
        "is the cause named where the baseline itself fails?",
        lambda cases, jobs: [str(max(1, cases // 3)), str(FIRST_SEED), str(jobs)],
        parallel=True,
    ),
    Table("diagnose_first_validate", "the same for drives", _seeds("--cases", 3)),
    Table(
        "other_laws", "is the part at fault found where its law has another form?", lambda n, _: [str(max(1, n // 15))]
    ),
    Table("recovery", "is the truth found as well as the data allow?", _seeds("--vehicles")),
    Table("coverage", "do 95 % intervals of coast-downs cover 95 %?", lambda cases, _: [str(10 * cases)]),
    Table("road_profile", "is a surveyed road used well?", lambda cases, _: [str(cases)]),
    Table("clocks", "are delay and drift of two loggers found?", lambda cases, _: [str(cases)]),
    Table("log_faults", "are faults in logs found, and healthy logs not accused?", lambda *_: []),
    Table("faults", "are wrong inputs refused with place and remedy?", lambda *_: []),
)


@dataclass(frozen=True)
class Made:
    """What became of a table."""

    table: Table
    command: str
    minutes: float
    code: int


def made(table: Table, cases: int, jobs: int) -> Made:
    """Write one table, and say so on the console."""
    arguments, begun = table.arguments(cases, jobs), time.perf_counter()
    code = subprocess.run(
        [sys.executable, "-m", f"tests.bench.{table.name}", *arguments],
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
        check=False,
    ).returncode
    found = Made(
        table,
        " ".join(["python -m", f"tests.bench.{table.name}", *arguments]),
        (time.perf_counter() - begun) / 60,
        code,
    )
    print(f"{found.command}: exit {code}, {found.minutes:.1f} min", flush=True)
    return found


def page(results: list[Made], commit: str) -> str:
    """The overview: question, page, command and time of each table."""
    lines = [
        "# Tables of accuracy",
        "",
        f"Written by `python -m tests.bench.tables`; all of commit {commit}. Each page states what is",
        "wanted, and what is short of it.",
        "",
        "| question | page | command | minutes |",
        "|---|---|---|---|",
    ]
    for one in results:
        name, took = one.table.name, f"{one.minutes:.1f}" if one.code == 0 else f"failed with exit code {one.code}"
        lines.append(f"| {one.table.question} | [{name}.md]({name}.md) | `{one.command}` | {took} |")
    return "\n".join(lines) + "\n"


def _git(*arguments: str) -> str:
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=30, help="vehicles a row")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", nargs="*", default=[t.name for t in TABLES], choices=[t.name for t in TABLES])
    options = parser.parse_args()
    if _git("status", "--porcelain", "--untracked-files=no"):
        parser.error("the working tree has changes: commit them first, so that the tables are of one commit")
    commit = _git("rev-parse", "--short", "HEAD")
    wanted = [t for t in TABLES if t.name in options.only]
    results = [made(t, options.cases, options.jobs) for t in wanted if t.parallel]
    with ThreadPoolExecutor(options.jobs) as pool:
        results += pool.map(lambda t: made(t, options.cases, 1), [t for t in wanted if not t.parallel])
    PAGE.write_text(page(results, commit), encoding="utf-8")


if __name__ == "__main__":
    main()
