"""Parallel execution of steps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from vdyn_cli.commands.step_processes import side_by_side
from vdyn_cli.project.pipeline import Task


def test_steps_that_wait_for_each_other_are_refused() -> None:
    tasks = [Task("cg", Path("cg.yaml"), ("bump",)), Task("bump", Path("bump.yaml"), ("cg",))]
    attempt: Any = None  # no step starts
    with pytest.raises(ValueError, match="steps wait for others that never end: cg, bump"):
        list(side_by_side(tasks, 2, attempt, {}))
