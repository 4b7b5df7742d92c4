"""The sample test day as a user runs it: all steps, their diagnoses, the parameter set, the report, all exports."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from vdyn_cli import steps
from vdyn_cli.cli import app
from vdyn_cli.export import FORMATS

FEWEST_PARAMETERS = 20  # whose true values the sample logs' page states


def vdyn(*arguments: object) -> None:
    done = CliRunner().invoke(app, [str(a) for a in arguments])
    assert done.exit_code == 0, done.stderr


@pytest.fixture(scope="module")
def day(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of results of the whole pipeline, run once."""
    folder = tmp_path_factory.mktemp("day")
    vdyn("pipeline", root / "configs" / "pipeline.yaml", "-o", folder)
    return folder


@pytest.fixture(scope="module")
def document(day: Path) -> dict[str, Any]:
    return json.loads((day / "parameters.json").read_text(encoding="utf-8"))


def test_every_step_is_good_and_no_model_error_is_reported(document: dict[str, Any]) -> None:
    assert set(document["steps"]) == set(steps.names())
    verdicts = {name: step["verdict"] for name, step in document["steps"].items()}
    assert verdicts == {name: "" if name == "area" else "adequate" for name in steps.names()}


def test_every_true_value_lies_in_its_interval(document: dict[str, Any], root: Path) -> None:
    page = (root / "sample_logs" / "README.md").read_text(encoding="utf-8")
    truth = {name: float(value) for name, value in re.findall(r"^\| (\w+) \| ([\d.]+) \|$", page, re.MULTILINE)}
    estimated = {n: e for n, e in document["parameters"].items() if n in truth and e["source"] != "given"}
    assert len(estimated) >= FEWEST_PARAMETERS
    missed = {n: e for n, e in estimated.items() if not e["interval95"][0] <= truth[n] <= e["interval95"][1]}
    assert not missed


def test_each_step_has_its_json_and_its_report(day: Path) -> None:
    files = [f"{name}.{ending}" for name in steps.names() for ending in ("html", "json")]
    assert sorted(p.name for p in day.iterdir()) == sorted([*files, "parameters.json", "report.html", ".sections"])


@pytest.mark.parametrize("form", FORMATS)
def test_it_can_be_exported(day: Path, form: str, tmp_path: Path) -> None:
    vdyn("export", day / "parameters.json", "--to", form, "-o", tmp_path)
    assert all(path.stat().st_size > 0 for path in tmp_path.iterdir())
    assert list(tmp_path.iterdir())
