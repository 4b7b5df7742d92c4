"""Does each step find the truth, as well as the data allow, with honest intervals? Many random vehicles a step.

    python -m tests.bench.recovery [--step NAME] [--vehicles N] [--first SEED] [--print]

writes tests/bench/recovery.md, one section a case; only the sections of the steps that ran are replaced.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.bench.cases import CASES as USUAL_CASES
from tests.bench.cases import Case
from tests.bench.input_cases import INPUT_CASES
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.errors import VdynError
from vdyn_cli.steps import names

CASES = {**USUAL_CASES, **INPUT_CASES}
PAGE = Path(__file__).with_name("recovery.md")
FIRST_SEED = 1000  # apart from the seeds of the unit tests
WANTED_RMSE, WANTED_BIAS, WANTED_COVERAGE = 1.25, 0.2, (0.92, 0.97)
HEAD = """# Recovery of known vehicles

Written by `python -m tests.bench.recovery`. Each section: random vehicles from the truth plant, their logs and
description through the whole step, errors against the truth. *rmse*: relative to the truth's own. *rmse/bound*:
root-mean-square of error over the vehicle's own Cramer-Rao bound (wanted: at most 1.25). *bias/sd*: mean error over
the spread of the errors (at most 0.2; its own chance error is 1/sqrt(vehicles)). *covered*: share of 95 % intervals
that hold the truth (92 to 97 %; chance error 0.22/sqrt(vehicles)). *said/true sd*: mean stated standard deviation
over the rmse. *worst*: largest error over its bound. Bold: outside what is wanted.
"""


@dataclass(frozen=True)
class Trial:
    """One parameter of one vehicle."""

    name: str
    seed: int
    truth: float
    bound: float
    value: float
    std: float
    interval: tuple[float, float]


@dataclass(frozen=True)
class Report:
    """All trials of a case; ``refused`` counts the messages of vehicles that got no answer, or not this parameter."""

    case: str
    vehicles: int
    trials: tuple[Trial, ...]
    refused: Counter[str]
    seconds: float


def run(name: str, case: Case, vehicles: int, first: int) -> Report:
    """Make and estimate each vehicle in a folder of its own."""
    trials: list[Trial] = []
    refused: Counter[str] = Counter()
    seconds = 0.0
    for seed in range(first, first + vehicles):
        with tempfile.TemporaryDirectory() as folder:
            made = case.make(seed, Path(folder))
            begun = time.perf_counter()
            try:
                found = execute(case.step, made.description, level=None).document["parameters"]
            except VdynError as error:
                refused[error.findings[0].what] += 1
                continue
            except Exception as error:  # a bug is a result of the bench too
                refused[f"crashed: {error!r}"] += 1
                continue
            finally:
                seconds += time.perf_counter() - begun
        for parameter, truth in made.truth.items():
            if parameter not in found:
                refused[f"{parameter} not given"] += 1
                continue
            entry = found[parameter]
            low, high = entry["interval95"]
            bound = made.bound[parameter]
            trials.append(Trial(parameter, seed, truth, bound, entry["value"], entry["std"], (low, high)))
    return Report(name, vehicles, tuple(trials), refused, seconds / vehicles)


def section(report: Report, case: Case) -> str:
    """The case as Markdown."""
    lines = [f"## {report.case}", "", f"{case.about} {report.vehicles} vehicles.", ""]
    lines += ["| parameter | rmse | rmse/bound | bias/sd | covered | said/true sd | worst (seed) |"]
    lines += ["|---|---|---|---|---|---|---|"]
    for parameter in dict.fromkeys(trial.name for trial in report.trials):
        lines.append(_row(parameter, [trial for trial in report.trials if trial.name == parameter]))
    for message, count in report.refused.most_common():
        lines.append(f"\n**{count} of {report.vehicles}**: {message}")
    return "\n".join(lines) + "\n"


def _row(parameter: str, trials: Sequence[Trial]) -> str:
    def column(name: str) -> NDArray[np.float64]:
        return np.array([getattr(trial, name) for trial in trials])

    error = column("value") - column("truth")
    scaled = error / column("bound")
    low, high = column("interval").T
    share = 100 * float(np.sqrt(np.mean(error**2) / np.mean(column("truth") ** 2)))
    rmse = float(np.sqrt(np.mean(scaled**2)))
    bias = float(np.mean(scaled) / np.std(scaled)) if len(trials) > 1 else float("nan")
    covered = float(np.mean((low <= column("truth")) & (column("truth") <= high)))
    said = float(np.sqrt(np.mean((column("std") / column("bound")) ** 2)) / rmse)
    worst = int(np.argmax(np.abs(scaled)))
    cells = [
        f"{share:.3g} %",
        _bold(f"{rmse:.2f}", rmse <= WANTED_RMSE),
        _bold(f"{bias:+.2f}", abs(bias) <= WANTED_BIAS),
        _bold(f"{100 * covered:.0f} %", WANTED_COVERAGE[0] <= round(covered, 9) <= WANTED_COVERAGE[1]),
        f"{said:.2f}",
        f"{scaled[worst]:+.1f} ({trials[worst].seed})",
    ]
    return f"| {parameter} | " + " | ".join(cells) + " |"


def _bold(text: str, good: bool) -> str:
    return text if good else f"**{text}**"


def merged(page: str, sections: dict[str, str]) -> str:
    """The page with the new sections in the place of their old ones, in the order of the cases."""
    old = {part.split("\n", 1)[0].strip(): f"## {part.rstrip()}\n" for part in page.split("\n## ")[1:]}
    kept = {**old, **sections}
    return "\n".join([HEAD, *(kept[name] for name in CASES if name in kept)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--step", help="a step (all of its cases) or one case; default all")
    parser.add_argument("--vehicles", type=int, default=100)
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="seed of the first vehicle")
    parser.add_argument("--print", action="store_true", help="only print, leave recovery.md as it is")
    options = parser.parse_args()
    chosen = {n: c for n, c in CASES.items() if options.step in (None, n, c.step) and c.step in names()}
    if not chosen:
        parser.error(f"no such step or case (cases: {', '.join(CASES)})")
    sections = {}
    for name, case in chosen.items():
        report = run(name, case, options.vehicles, options.first)
        sections[name] = section(report, case)
        print(f"{sections[name]}\n{report.seconds:.2f} s a vehicle\n", flush=True)
    if not options.print:
        page = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
        PAGE.write_text(merged(page, sections), encoding="utf-8")


if __name__ == "__main__":
    main()
