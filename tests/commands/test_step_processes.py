"""Parallel execution of steps."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from vdyn_cli.commands import step_processes
from vdyn_cli.commands.step_processes import side_by_side
from vdyn_cli.project.pipeline import StepOutcome, Task

TASKS = (Task("cg", Path("cg.yaml"), ()), Task("bump", Path("bump.yaml"), ("cg",)))
PATIENCE = 60.0  # s, after which a step that should have started is missed


def test_steps_that_wait_for_each_other_are_refused() -> None:
    tasks = [Task("cg", Path("cg.yaml"), ("bump",)), Task("bump", Path("bump.yaml"), ("cg",))]
    attempt: Any = None  # no step starts
    with pytest.raises(ValueError, match="steps wait for others that never end: cg, bump"):
        list(side_by_side(tasks, 2, attempt, {}))


def begun_after(task: Task, outcomes: Mapping[str, StepOutcome], test: object, folder: Path) -> Iterator[StepOutcome]:
    """An attempt that draws its page only when the step that reads its result has begun."""
    (folder / task.name).touch()
    yield StepOutcome(task.name, "done", reason="result")
    latest = time.monotonic() + PATIENCE
    while task.name == "cg" and not (folder / "bump").exists() and time.monotonic() < latest:
        time.sleep(0.01)
    yield StepOutcome(task.name, "done", reason="page" if (folder / "bump").exists() else "bump has not begun")


def test_a_step_starts_when_the_results_it_reads_exist_not_their_pages(tmp_path: Path) -> None:
    found = [outcome for outcome, _ in side_by_side(TASKS, 2, partial(begun_after, folder=tmp_path), {})]
    assert {o.name: o.reason for o in found} == {"cg": "page", "bump": "page"}


def read_before(task: Task, outcomes: Mapping[str, StepOutcome], test: object, folder: Path) -> Iterator[StepOutcome]:
    """An attempt that ends only when the logs of the step that reads its result are read."""
    latest = time.monotonic() + PATIENCE
    while task.name == "cg" and not (folder / "bump.yaml").exists() and time.monotonic() < latest:
        time.sleep(0.01)
    yield StepOutcome(task.name, "done", reason=f"{test}, {sorted(outcomes)}")


def test_the_logs_of_a_step_are_read_while_an_earlier_step_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def logged_test(step: object, path: Path) -> str:
        (tmp_path / path).touch()
        return f"logs of {path}"

    monkeypatch.setattr(step_processes, "step_of", str)
    monkeypatch.setattr(step_processes, "logged_test", logged_test)
    found = {o.name: o.reason for o, _ in side_by_side(TASKS, 2, partial(read_before, folder=tmp_path), {})}
    assert found == {"cg": "None, []", "bump": "logs of bump.yaml, ['cg']"}


def killed_at_its_page(task: Task, outcomes: Mapping[str, StepOutcome], test: object) -> Iterator[StepOutcome]:
    """An attempt of which one process is killed while it draws its page."""
    yield StepOutcome(task.name, "done", reason="result")
    if task.name == "cg":
        os.kill(os.getpid(), signal.SIGKILL)
    yield StepOutcome(task.name, "done", reason="page")


def test_a_step_killed_while_it_draws_its_page_has_failed() -> None:
    found = {o.name: o.status for o, _ in side_by_side(TASKS, 2, killed_at_its_page, {})}
    assert found == {"cg": "failed", "bump": "done"}
