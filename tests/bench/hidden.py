"""Hide an effect in the logs of random vehicles and ask the program: a matrix of steps, effects and controls.

    python -m tests.bench.hidden [--seeds 30] [--step NAME] [--cell TEXT] [--jobs 2] [--out FILE] [--print] [--log FILE]

writes tests/bench/hidden.md, one section a step; only the sections of the steps that ran are replaced, anew after every
vehicle. It goes the command's way, from files to the JSON document. Set OPENBLAS_NUM_THREADS=1. It takes hours: with
--log it may be stopped at any time, and goes on from there (with another program, start another log). The trials of
validate, which is by far the longest, are kept: --step validate --log tests/bench/hidden_validate.jsonl adds to them.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import groupby
from pathlib import Path

from tests.bench.hidden_cases import CASES, Cell
from tests.bench.hidden_log import recalled, remember
from tests.bench.hidden_table import merged, section
from tests.bench.hidden_trial import Trial, judged, run

PAGE = Path(__file__).with_name("hidden.md")
FIRST_SEED = 3000  # apart from the seeds of unit tests and of the recovery bench


Task = tuple[Cell, int, bool, bool]


def _one(task: Task) -> Trial:
    cell, seed, strengths, fresh = task
    return run(cell, seed, strengths, fresh)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=30, help="vehicles a cell")
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="seed of the first vehicle")
    parser.add_argument("--step", help="only this step")
    parser.add_argument("--cell", default="", help="only cells whose name holds this text")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--fresh", type=int, default=10, help="vehicles a cell whose gain is checked on fresh logs")
    parser.add_argument("--no-strength", action="store_true", help="leave the Cramer-Rao t out: quicker, not scored")
    parser.add_argument("--out", type=Path, default=PAGE)
    parser.add_argument("--print", action="store_true", help="only print, leave the page as it is")
    parser.add_argument("--log", type=Path, help="what has been tried, to go on from: appended to after every trial")
    options = parser.parse_args()
    cells = [c for c in CASES if options.step in (None, c.step) and options.cell in c.name]
    if not cells:
        parser.error("no such cell")
    seeds = range(options.first, options.first + options.seeds)
    # Vehicle by vehicle: what a vehicle's logs could show where nothing is hidden is kept from cell to cell.
    tasks = [
        (cell, seed, not options.no_strength, seed < options.first + options.fresh)
        for _, same in groupby(cells, key=lambda c: c.step)
        for group in [list(same)]
        for seed in seeds
        for cell in group
    ]
    trials: dict[Cell, list[Trial]] = {cell: [] for cell in cells}
    kept = not (options.print or options.cell)
    known = recalled(options.log) if options.log else {}
    for (cell, *_), trial in zip(tasks, _outcomes(tasks, known, options.jobs, len(cells)), strict=True):
        trials[cell].append(trial)
        if options.log and (cell.name, trial.seed) not in known:
            remember(options.log, cell, trial)
        print(f"{cell.name} [{trial.seed}]: {judged(cell, trial)} ({_said(trial)})", file=sys.stderr, flush=True)
        if kept and len({len(trials[c]) for c in cells if c.step == cell.step}) == 1:  # a vehicle is through
            _write(options.out, _sections(trials))
    if not kept:
        print("\n".join(_sections(trials).values()))


def _sections(trials: Mapping[Cell, Sequence[Trial]]) -> dict[str, str]:
    return {
        step: section(step, [(cell, trials[cell]) for cell in group])
        for step, group in groupby(trials, key=lambda c: c.step)
        if all(trials[cell] for cell in trials if cell.step == step)
    }


def _write(page: Path, sections: Mapping[str, str]) -> None:
    text = page.read_text(encoding="utf-8") if page.exists() else ""
    page.write_text(merged(text, sections), encoding="utf-8")


def _outcomes(
    tasks: Sequence[Task], known: Mapping[tuple[str, int], Trial], jobs: int, vehicle: int
) -> Iterator[Trial]:
    """In the order of the tasks, of which each ``vehicle`` in a row are about one vehicle; tried is what is new."""
    new = [task for task in tasks if (task[0].name, task[1]) not in known]
    with ProcessPoolExecutor(jobs) as pool:
        tried = map(_one, new) if jobs == 1 else pool.map(_one, new, chunksize=vehicle)
        for cell, seed, *_ in tasks:
            yield known.get((cell.name, seed)) or next(tried)


def _said(trial: Trial) -> str:
    strengths = ", ".join(f"t {t:.1f}, {trial.least[name]:.1f} against rivals" for name, t in trial.t.items())
    names: Sequence[str] = sorted(trial.named) or ["+".join(sorted(answer)) for answer in trial.among]
    return "; ".join(part for part in (strengths, trial.verdict, " or ".join(names), f"{trial.seconds:.1f} s") if part)


if __name__ == "__main__":
    main()
