"""How the time of a command grows with rows, runs and drives: ``python -m tests.bench.growth`` writes growth.md.

Every row is the whole command, reading and report included, in a process of its own. Seconds are the processor's;
memory is the largest that the process held. Coast-downs have a hidden headwind; drives, of the full vehicle, are 45 s
long at 200 Hz with a hidden driveline drag, and their time is also given as a ratio to one simulation of the same
drives with the final parameters, without sensitivities. Commands on the sample day are given by processor and clock,
without kept machine code and with it. ``--most N`` leaves out campaigns of more than N rows; ``--day`` writes the
sample day's table alone, to the console.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command itself does

import numpy as np

from tests.bench import cases, hidden_logs
from tests.plant import coast, drive
from tests.plant.drive_motion import Pedals
from tests.plant.vehicle import random_vehicle
from vdyn_cli.project.inputs import gather
from vdyn_cli.steps import load_step
from vdyn_cli.steps.validate.problem import ValidateProblem

PAGE = Path(__file__).with_suffix(".md")
SEED = 8503
RATES = ((10.0, 8), (100.0, 8), (1000.0, 8), (1000.0, 70))  # Hz, coasts
RUNS = (8, 25, 100, 300, 1000)
DRIVES = (2, 6)
RATE, LENGTH = 200.0, 45.0  # Hz and s of a drive
CONFIGS = Path(__file__).parents[2] / "configs"
DAY_HEAD = "| command | processor s | clock s | wanted, clock s |\n|---|---|---|---|"
WANTED_DAY = 10.0  # s
HEAD = "| {} | rows | without diagnosis s | with s | GB | answer |\n|---|---|---|---|---|---|"
MEASURE = """
import resource, subprocess, sys, time
begun = time.perf_counter()
code = subprocess.run(sys.argv[1:], capture_output=True).returncode
clock = time.perf_counter() - begun
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(code, used.ru_utime + used.ru_stime, used.ru_maxrss / 1e6, clock)
"""


@dataclass(frozen=True)
class Cost:
    """Processor seconds, peak memory, GB, and seconds by the clock of one command."""

    seconds: float
    memory: float
    clock: float


def cost(step: str, description: Path, folder: Path, *options: str) -> Cost:
    """The cost of ``vdyn STEP``, whatever its verdict."""
    return command_cost(step, str(description), "-q", "-o", str(folder), *options)


def command_cost(*arguments: str) -> Cost:
    """The cost of ``vdyn`` with these arguments.

    Raises
    ------
    RuntimeError : the input was wrong, or a bug.
    """
    command = [sys.executable, "-c", MEASURE, sys.executable, "-m", "vdyn_cli", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    code, seconds, memory, clock = done.stdout.split()
    if int(code) > 1:
        raise RuntimeError(f"vdyn {' '.join(arguments)} ended with exit code {code}")
    return Cost(float(seconds), float(memory), float(clock))


def coasts(folder: Path, rate: float, runs: int) -> Path:
    """A coast-down campaign with a hidden headwind."""
    folder.mkdir()
    day = coast.WIDE.but(rate=rate, runs=runs)
    return cases.coast_downs(random_vehicle(SEED), SEED, folder, day, False, {"headwind": 1.5})


def drives(folder: Path, count: int, hidden: Mapping[str, float]) -> Path:
    """Drives of a full vehicle as a tester describes them."""
    folder.mkdir()
    pedals = drive.pedals

    def short(vehicle: object, seed: int, number: int = 3) -> list[Pedals]:
        return [_cut(one) for one in pedals(random_vehicle(SEED), seed, count)]

    scenario = SimpleNamespace(vehicle=random_vehicle(SEED), seed=SEED, drawn=SEED, effects=dict(hidden))
    with patch.object(drive, "pedals", short), patch.object(drive, "RATE", RATE):
        return hidden_logs.WRITERS["validate"](scenario, folder)  # type: ignore[arg-type]


def _cut(one: Pedals) -> Pedals:
    knots = (*(k for k in one.knots if k < LENGTH), LENGTH)
    pressed = {n: tuple(np.interp(knots, one.knots, getattr(one, n)).tolist()) for n in ("drive", "brake")}
    return replace(one, knots=knots, **pressed)


def one_simulation(description: Path, known: Sequence[Path] = ()) -> float:
    """Processor seconds of simulating all drives once, without sensitivities."""
    step = load_step("validate")
    inputs = gather(step, description, known)
    problem = step.prepare(inputs.spec, inputs.data, inputs.known)
    assert isinstance(problem, ValidateProblem)
    setup, seconds = problem.baseline, []
    for _ in range(3):
        begun = time.process_time()
        setup.each(lambda k: setup.simulate(k, setup.vector.start(k), slopes=False))
        seconds.append(time.process_time() - begun)
    return min(seconds)


def row(label: str, step: str, description: Path, folder: Path, simulated: float = float("nan")) -> str:
    """One row of a table.

    Parameters
    ----------
    simulated : processor seconds of one simulation of the same logs, to which the time with diagnosis is compared.
    """
    plain = cost(step, description, folder / "plain", "--no-diagnose")
    whole = cost(step, description, folder / "whole")
    rows = sum(len(p.read_bytes().splitlines()) - 1 for p in description.parent.glob("*.csv"))
    found = json.loads((folder / "whole" / f"{step}.json").read_text(encoding="utf-8"))["diagnosis"]
    causes = ", ".join(c["effect"] for c in found["causes"])
    return (
        f"| {label} | {rows} | {plain.seconds:.1f} | {whole.seconds:.1f} | {max(plain.memory, whole.memory):.2f} "
        f"| {found['verdict']} {causes}"
        + (f", {whole.seconds / simulated:.0f} times one simulation |" if simulated > 0 else " |")
    )


def sample_day(folder: Path) -> list[str]:
    """The table of commands on the sample day, each twice: the first compiles its machine code."""
    out = folder / "day"
    lines = ["Sample day: whole commands.", "", DAY_HEAD]
    with patch.dict(os.environ, {"VDYN_CACHE": str(folder / "kept")}):
        for number, label in enumerate(("machine code compiled", "machine code kept")):
            if number:
                shutil.rmtree(out)  # else results would be reused
            one = command_cost("pipeline", str(CONFIGS / "pipeline.yaml"), "-q", "-o", str(out))
            lines.append(f"| pipeline, {label} | {one.seconds:.1f} | {one.clock:.1f} | {WANTED_DAY:g} |")
        known = ("--known", str(out / "parameters.json"))
        one = cost("validate", CONFIGS / "validate.yaml", folder / "validate", *known)
        lines.append(f"| validate, machine code kept | {one.seconds:.1f} | {one.clock:.1f} | |")
    simulated = one_simulation(CONFIGS / "validate.yaml", (out / "parameters.json",))
    ratio = one.seconds / simulated
    return [
        *lines,
        "",
        f"One simulation of the sample drives: {simulated:.2f} s; validate takes {ratio:.0f} times that.",
        "",
    ]


def page(most: int) -> str:
    """The tables."""
    lines = [
        "# Growth of time with rows, runs and drives",
        "",
        f"Written by `python -m tests.bench.growth --most {most}`.",
        "",
    ]
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        lines += sample_day(folder)
        lines += ["Rows: coasts of about 150 s.", "", HEAD.format("rate")]
        for rate, count in RATES:
            if count * 150 * rate <= most:
                path = coasts(folder / f"rate{rate:g}_{count}", rate, count)
                lines.append(row(f"{rate:g} Hz, {count} coasts", "coastdown", path, path.parent / "out"))
        lines += ["", "Runs: coasts at 5 Hz.", "", HEAD.format("runs")]
        for runs in RUNS:
            if runs * 150 * 5 <= most:
                path = coasts(folder / f"runs{runs}", 5.0, runs)
                lines.append(row(f"{runs}", "coastdown", path, path.parent / "out"))
        lines += ["", "Drives of the full vehicle, 45 s at 200 Hz.", "", HEAD.format("drives")]
        for count in DRIVES:
            for label, hidden in (("nothing hidden", {}), ("150 N of driveline drag", {"driveline_drag": 150.0})):
                path = drives(folder / f"drives{count}{len(hidden)}", count, hidden)
                simulated = one_simulation(path)
                lines.append(row(f"{count}, {label}", "validate", path, path.parent / "out", simulated))
            lines += ["", f"One simulation of the {count} drives: {simulated:.2f} s.", ""]
            lines += [HEAD.format("drives")] if count != DRIVES[-1] else []
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--most", type=int, default=20_000_000, help="rows of the largest campaign")
    parser.add_argument("--day", action="store_true", help="the sample day alone, to the console")
    options = parser.parse_args()
    if options.day:
        with tempfile.TemporaryDirectory() as temporary:
            print("\n".join(sample_day(Path(temporary))))
        sys.exit()
    text = page(options.most)
    PAGE.write_text(text, encoding="utf-8")
    print(text)
