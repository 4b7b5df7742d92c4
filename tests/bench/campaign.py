"""Random inputs and kills: ``python -m tests.bench.campaign [INPUTS [COMMANDS [KILLS]]]`` writes campaign.md.

Each input is a sample description, log or parameter file with random damage (tests/damage.py), in process (5000) or by
the command line (500). Each kill ends a pipeline by a random signal at a random time, with ``--jobs`` 1 or 2 (200).
Broken is: a traceback or a bug, a library's warning, more than 30 s of processor time (300 s by the clock), a file that
is not whole, a process or temporary file that is left, and, after a kill, a second run whose files have other bytes
than those of an undisturbed one.
"""

from __future__ import annotations

import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from tests.bench.fault_files import end_by_signal
from tests.damage import damaged_bytes, damaged_text, logs_of, small_day, survives
from vdyn_cli import steps

ROOT = Path(__file__).resolve().parent.parent.parent
TABLE = Path(__file__).with_suffix(".md")
START = "import sys; from vdyn_cli.cli import main; sys.argv[0] = 'vdyn'; main()"
FIRST_SEED = 500_000  # of the table
LONGEST = 30.0  # s
LEVEL = 0.05
DIAGNOSED = 0.1  # of the inputs; the others leave the diagnosis out
SIGNALS = (signal.SIGTERM, signal.SIGKILL, signal.SIGINT)
SMALL = "pipeline: a day\nvehicle: vehicle.yaml\nsteps: [area.yaml, cg.yaml]\n"
FORMS = ("c", "tir", "abc")


@dataclass(frozen=True)
class Outcome:
    """What became of one input: its exit code, the time it took, and what is broken; empty where it is clean."""

    what: str
    code: int
    seconds: float
    broken: str = ""


@contextmanager
def damaged(folder: Path, chance: random.Random) -> Iterator[str]:
    """A step of the day in the folder with a damaged description, log, or both, until the block ends."""
    step = chance.choice(list(steps.names()))
    known = folder / "known.json"
    logs = logs_of(step, folder)
    kinds = chance.choice((("description",), ("log",), ("log",), ("description", "log")))
    paths = [folder / f"{step}.yaml" if k == "description" or not logs else folder / chance.choice(logs) for k in kinds]
    paths += [known] if chance.random() < 0.15 else []
    good = {path: path.read_bytes() for path in paths}
    try:
        for path in paths:
            if path.suffix in (".yaml", ".json"):
                text = damaged_text(path.read_text(encoding="utf-8"), chance)
                path.write_text(text, encoding="utf-8", errors="replace")
            else:
                path.write_bytes(damaged_bytes(path.read_bytes(), chance))
        yield step
    finally:
        for path, data in good.items():
            path.write_bytes(data)


def in_process(seed: int) -> Outcome:
    """One input through a step's function."""
    chance, folder = random.Random(seed), _day()
    start, broken, code = _spent(), "", -1
    with warnings.catch_warnings(record=True) as heard, damaged(folder, chance) as step:
        warnings.simplefilter("always")
        try:
            code = survives(step, folder, LEVEL if chance.random() < DIAGNOSED else None, (folder / "known.json",))
        except BaseException as error:  # whatever leaves the step is broken
            broken = "".join(traceback.format_exception(error)[-2:])
    seconds = _spent() - start
    told = [broken] if broken else [str(w.message) for w in heard if w.category is not ResourceWarning]
    return Outcome(f"seed {seed}, {step}", code, seconds, _late(seconds, told))


def by_command(seed: int) -> Outcome:
    """One input through the command line."""
    chance, folder = random.Random(seed), _day()
    shutil.rmtree(folder / "out", ignore_errors=True)
    logs = {step: [n for n in logs_of(step, folder) if n.endswith(".csv")] for step in steps.names()}
    with damaged(folder, chance) as step:
        arguments = _arguments(step, logs[step], chance)
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        start = _spent()
        done = subprocess.run(
            [sys.executable, "-c", START, *arguments], cwd=folder, env=environment, capture_output=True, timeout=300,
            check=False, text=True, errors="replace",
        )  # fmt: skip
        seconds = _spent() - start
    broken = [] if done.returncode in (0, 1, 2) else [f"exit {done.returncode}"]
    if found := re.search("Traceback|vdyn has a bug|Warning:|\x1b", done.stderr):
        broken.append(f"prints {found.group()!r}")
    if done.returncode == 2 and not done.stderr.strip():
        broken.append("exit 2 without a message")
    broken += _not_whole(folder / "out")
    return Outcome(f"seed {seed}, vdyn {' '.join(arguments)}", done.returncode, seconds, _late(seconds, broken))


def _arguments(step: str, logs: Sequence[str], chance: random.Random) -> list[str]:
    """A random command on a step's files."""
    known = ["--known", "known.json"]
    choices = [
        [step, f"{step}.yaml", "-o", "out", "--no-diagnose", *known],
        [step, f"{step}.yaml", "-o", "-", "-q", *known],
        ["check", f"{step}.yaml"],
        ["export", "known.json", "--to", chance.choice(FORMS), "-o", "out"],
    ]
    if logs:
        choices += [["channels", *logs], ["init", step, *logs, "-o", "drawn.yaml"]]
    return chance.choice(choices)


def kill(seed: int) -> Outcome:
    """One pipeline that is ended, and run again."""
    chance, folder = random.Random(seed), Path(tempfile.mkdtemp())
    undisturbed = _undisturbed()
    try:
        shutil.copytree(undisturbed, folder, dirs_exist_ok=True)
        shutil.rmtree(folder / "out")
        number, jobs = chance.choice(SIGNALS), chance.choice((1, 2))
        delay = chance.uniform(0.1, 6.0)
        arguments = ["pipeline", "small.yaml", "-o", "../out", "--jobs", str(jobs), "-q"]
        broken = []
        here = Path.cwd()
        os.chdir(folder / "configs")
        try:
            end_by_signal(int(number), delay, arguments)
            broken += _not_whole(folder / "out", temporary=number is not signal.SIGKILL)
        except AssertionError:
            broken.append("processes are left")
        finally:
            os.chdir(here)
        start = _spent()
        code = _vdyn(folder / "configs", arguments)
        seconds = _spent() - start
        broken += [] if code == 0 else [f"second run: exit {code}"]
        broken += _other_bytes(folder / "out", undisturbed / "out")
        return Outcome(f"seed {seed}, {number.name} after {delay:.2f} s, --jobs {jobs}", code, seconds,
                       _late(seconds, broken))  # fmt: skip
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _spent() -> float:
    """Processor seconds of this process and of those that it started: the same beside another load."""
    return sum(os.times()[:4])


def _late(seconds: float, broken: Sequence[str]) -> str:
    late = [f"{seconds:.0f} s"] if seconds > LONGEST else []
    return "; ".join((*broken, *late)).replace("\n", " ")


def _not_whole(out: Path, temporary: bool = True) -> list[str]:
    """Files that are not whole, and temporary ones that are left."""
    broken = []
    for path in out.rglob("*") if out.exists() else ():
        if path.name.endswith(".vdyn-tmp"):
            broken += [f"{path.name} is left"] if temporary else []
        elif path.suffix == ".json":
            try:
                json.loads(path.read_text(encoding="utf-8"))
            except ValueError:
                broken.append(f"{path.name} is not whole")
        elif path.suffix == ".html" and not path.read_bytes().rstrip().endswith((b"</html>", b"</section>")):
            broken.append(f"{path.name} is not whole")
    return broken


def _other_bytes(made: Path, first: Path) -> list[str]:
    def every(folder: Path) -> dict[str, bytes]:
        return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}

    one, two = every(made), every(first)
    return [f"{name} differs" for name in sorted(one.keys() | two.keys()) if one.get(name) != two.get(name)]


def _vdyn(folder: Path, arguments: Sequence[str]) -> int:
    line = [sys.executable, "-c", START, *arguments]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(line, cwd=folder, env=environment, capture_output=True, check=False).returncode


_FOLDERS: dict[str, Path] = {}  # of this process


def _day() -> Path:
    """This process's copy of the small day."""
    if "day" not in _FOLDERS:
        folder = small_day(ROOT, Path(tempfile.mkdtemp()), None)
        code = _vdyn(ROOT / "configs", ["pipeline", "pipeline.yaml", "-o", str(folder / "first"), "-q"])
        assert code == 0
        shutil.move(folder / "first" / "parameters.json", folder / "known.json")
        _FOLDERS["day"] = folder
    return _FOLDERS["day"]


def _undisturbed() -> Path:
    """This process's pipeline that nothing has disturbed."""
    if "pipeline" not in _FOLDERS:
        folder = Path(tempfile.mkdtemp())
        shutil.copytree(ROOT / "configs", folder / "configs")
        shutil.copytree(ROOT / "sample_logs", folder / "sample_logs")
        (folder / "configs" / "small.yaml").write_text(SMALL, encoding="utf-8")
        assert _vdyn(folder / "configs", ["pipeline", "small.yaml", "-o", "../out", "-q"]) == 0
        _FOLDERS["pipeline"] = folder
    return _FOLDERS["pipeline"]


def part(name: str, one: Callable[[int], Outcome], count: int, pool: ProcessPoolExecutor) -> tuple[str, list[str]]:
    """A row of the table, and what is broken."""
    outcomes = []
    for outcome in pool.map(one, range(FIRST_SEED, FIRST_SEED + count), chunksize=5):
        outcomes.append(outcome)
        if outcome.broken:
            print(f"broken: {name}, {outcome.what}: {outcome.broken}", flush=True)
        elif len(outcomes) % 100 == 0:
            print(f"{name}: {len(outcomes)}", flush=True)
    codes, broken = Counter(o.code for o in outcomes), [f"{o.what}: {o.broken}" for o in outcomes if o.broken]
    slowest = max((o.seconds for o in outcomes), default=0.0)
    cells = (name, count, *(codes[c] for c in (0, 1, 2)), len(broken), f"{slowest:.0f} s")
    return f"| {' | '.join(str(c) for c in cells)} |", broken


def main(inputs: int, commands: int, kills: int) -> None:
    """Try everything and write the table."""
    command = ["git", "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout.strip()
    rows, broken = [], []
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        for name, one, count in (
            ("inputs in process", in_process, inputs),
            ("inputs by the command line", by_command, commands),
            ("pipelines ended", kill, kills),
        ):
            row, faults = part(name, one, count, pool)
            rows.append(row)
            broken += faults
    lines = [
        "# Random inputs and kills",
        "",
        f"`python -m tests.bench.campaign {inputs} {commands} {kills}`, commit {commit}. What counts as broken stands "
        "at the head of tests/bench/campaign.py.",
        "",
        "| part | tried | exit 0 | exit 1 | exit 2 | broken | slowest |",
        "|---|---|---|---|---|---|---|",
        *rows,
        "",
        *(["## Broken", "", *(f"* {one}" for one in broken)] if broken else ["Nothing is broken."]),
    ]
    TABLE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    given = [int(a) for a in sys.argv[1:4]]
    main(*(*given, *(5000, 500, 200)[len(given) :]))
