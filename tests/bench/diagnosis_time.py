"""How long does a diagnosis take: of every step on the sample logs, and of ever longer coast-down campaigns?

    python -m tests.bench.diagnosis_time

writes tests/bench/diagnosis_time.md. Seconds are of the diagnosis alone, the step's own fit and reading left out; the
processor's, and the clock's. Each is taken in a process of its own, as in the command: machine code is made within it.
Campaigns tell how the cost grows with runs, a shorter catalog how it grows with effects.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command itself does

import yaml

from tests.bench import cases
from tests.plant import coast
from tests.plant.vehicle import random_vehicle
from vdyn_cli.diagnosis.diagnose import diagnosed
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep
from vdyn_cli.project.execute import execute
from vdyn_cli.project.inputs import gather
from vdyn_cli.project.pipeline import Task, load_plan
from vdyn_cli.project.result_document import to_json
from vdyn_cli.steps import load_step

PAGE = Path(__file__).with_name("diagnosis_time.md")
CONFIGS = Path(__file__).parents[2] / "configs"
RUNS = (25, 50, 100)
LIMIT_STEP, LIMIT_CAMPAIGN = 3.0, 30.0
SEED = 1
HEAD = """| {} | processor s | clock s | verdict | causes told of |
|---|---|---|---|---|"""
DAY = coast.WIDE.but(rate=5.0)
FEW = ["headwind", "road_grade", "tire_warmup", "speed_dependent_rolling"]


@dataclass(frozen=True)
class Timed:
    """One diagnosis."""

    processor: float
    clock: float
    verdict: str
    candidates: int


def timed(step_name: str, description: Path, known: Sequence[Path] = (), most: int = 2) -> Timed:
    """The quickest of a few, since other work on the machine only ever adds; nothing is at hand from the last."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn"), max_tasks_per_child=1) as pool:
        found = [pool.submit(once, step_name, description, known).result() for _ in range(most)]
    return min(found, key=lambda f: f.clock)


def once(step_name: str, description: Path, known: Sequence[Path]) -> Timed:
    """One diagnosis, after the step's estimate."""
    step = load_step(step_name)
    inputs = gather(step, description, known)
    problem = step.prepare(inputs.spec, inputs.data, inputs.known)
    base = problem.publish()
    processor, clock = time.process_time(), time.perf_counter()
    found = diagnosed(PreparedStep(step, inputs.spec, inputs.known, problem), base).diagnosis
    seconds = time.process_time() - processor, time.perf_counter() - clock
    assert found is not None
    return Timed(*seconds, found.verdict, len(found.ranking) + len(found.not_testable))


def campaign(folder: Path, runs: int, effects: list[str] | None = None) -> Path:
    """A coast-down campaign with a headwind nobody wrote down."""
    folder.mkdir()
    path = cases.coast_downs(random_vehicle(SEED), SEED, folder, DAY.but(runs=runs), False, {"headwind": 1.5})
    description = yaml.safe_load(path.read_text(encoding="utf-8"))
    if effects is not None:
        description["diagnose"] = {"effects": effects}
    path.write_text(yaml.safe_dump(description), encoding="utf-8")
    return path


def page() -> str:
    """The tables."""
    lines = ["# Time of a diagnosis", "", "Written by `python -m tests.bench.diagnosis_time`.", ""]
    lines += [f"Sample logs (wanted: below {LIMIT_STEP:g} s by the clock, on two cores):", ""]
    lines += [*HEAD.format("step").splitlines()]
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for task in load_plan(CONFIGS / "pipeline.yaml")[2]:
            if load_step(task.name).diagnosable is not None:
                known = [folder / f"{n}.json" for n in task.after]
                lines.append(row(task.name, timed(task.name, task.path, known), LIMIT_STEP))
            (folder / f"{task.name}.json").write_text(undiagnosed(task, folder), encoding="utf-8")
        lines += ["", f"Coast-downs with a hidden headwind (wanted: 100 runs below {LIMIT_CAMPAIGN:g} s):", ""]
        lines += [*HEAD.format("campaign").splitlines()]
        for runs in RUNS:
            path = campaign(folder / f"all{runs}", runs)
            lines.append(row(f"{runs} runs", timed("coastdown", path, most=1), LIMIT_CAMPAIGN))
        path = campaign(folder / "few", RUNS[-1], FEW)
        label = f"{RUNS[-1]} runs, {len(FEW)} effects"
        lines.append(row(label, timed("coastdown", path, most=1), LIMIT_CAMPAIGN))
    return "\n".join([*lines, ""])


def undiagnosed(task: Task, folder: Path) -> str:
    """What the step found, for those that need it."""
    known = [folder / f"{n}.json" for n in task.after]
    return to_json(execute(task.name, task.path, known, level=None).document)


def row(name: str, t: Timed, limit: float) -> str:
    clock = f"**{t.clock:.1f}**" if t.clock > limit else f"{t.clock:.1f}"
    return f"| {name} | {t.processor:.1f} | {clock} | {t.verdict} | {t.candidates} |"


if __name__ == "__main__":
    text = page()
    PAGE.write_text(text, encoding="utf-8")
    print(text)
