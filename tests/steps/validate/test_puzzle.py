"""The paper's puzzle through the command: a car that is slower than its simulation, for the motors that turn along."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from tests.plant import puzzle
from vdyn_cli.cli import app

pytestmark = pytest.mark.slow  # whole diagnoses or recoveries


@pytest.fixture(scope="module")
def reported(root: Path) -> dict[str, Any]:
    """The shipped description's document."""
    done = CliRunner().invoke(app, ["validate", str(root / "configs" / "puzzle.yaml"), "-o", "-", "-q"])
    assert done.exit_code == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_neither_wheels_nor_the_rig_but_the_motors(reported: dict[str, Any]) -> None:
    diagnosis = reported["diagnosis"]
    assert diagnosis["verdict"] == "named"
    assert [cause["effect"] for cause in diagnosis["causes"]] == ["motor_inertia"]
    assert diagnosis["extended"] == ["motor_inertia"]


def test_its_size_lies_within_its_interval(reported: dict[str, Any]) -> None:
    size = reported["diagnosis"]["causes"][0]["unknowns"]["motor_inertia"]
    low, high = size["interval95"]
    assert low <= puzzle.truth()["motor_inertia"] <= high
    assert high - low < 0.6


def test_what_is_left_out_is_predicted_better(reported: dict[str, Any]) -> None:
    gain = reported["diagnosis"]["gain"]
    assert gain["unit"] == "m/s"
    assert gain["before"] > 4 * gain["after"]
    assert gain["interval95"][0] > 0.5 * (gain["before"] - gain["after"])


def test_the_extended_car_stays_within_its_band(reported: dict[str, Any]) -> None:
    assert reported["validation"]["verdict"] == "inside"


@pytest.mark.thorough
def test_a_wide_belief_does_not_hide_it(root: Path, tmp_path: Path) -> None:
    """With a wide prior, the required change is still implausible, so that the effect is named, too."""
    data = yaml.safe_load((root / "configs" / "puzzle.yaml").read_text(encoding="utf-8"))
    data["vehicle"]["driveline_inertia"] = "0.10 +- 0.3 kg m^2"
    for run in data["runs"]:
        run["log"] = str((root / "configs" / run["log"]).resolve())
    path = tmp_path / "puzzle.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    done = CliRunner().invoke(app, ["validate", str(path), "-o", "-", "-q"])
    diagnosis = json.loads(done.stdout)["diagnosis"]
    assert diagnosis["verdict"] == "named"
    assert [cause["effect"] for cause in diagnosis["causes"]] == ["motor_inertia"]
