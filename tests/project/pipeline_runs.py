"""Pipelines run in this process."""

from __future__ import annotations

import json
from pathlib import Path

from vdyn_cli.commands.run_pipeline import run_pipeline

UNDIAGNOSED = "diagnose: {effects: none}\n"


def diagnosed(day: Path, *names: str) -> None:
    """Let these steps of a day be diagnosed, as they are by default."""
    for path in (day / f"{name}.yaml" for name in names):
        path.write_text(path.read_text().replace(UNDIAGNOSED, ""))


def silent(text: str, detail: bool = False) -> None:
    pass


def run(day: Path, out: str, jobs: int = 1) -> tuple[int, dict]:  # type: ignore[type-arg]
    folder = day.parent / out
    code = run_pipeline(day / "pipeline.yaml", folder, keep_going=True, jobs=jobs, tell=silent)
    return code, json.loads((folder / "parameters.json").read_text())
