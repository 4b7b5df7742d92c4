"""Play in the half-shafts of a car whose tires, flanks and idle torques follow other laws than the program's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.bench.hidden_logs import validation
from tests.plant.drive_with_play import campaign
from tests.plant.vehicle import random_vehicle
from vdyn_cli.project.execute import execute

pytestmark = pytest.mark.slow  # whole diagnoses


def diagnosis(folder: Path, seed: int, play: float) -> dict[str, Any]:
    """The diagnosis that the command gives for three drives."""
    car = random_vehicle(seed)
    runs = campaign(car, seed, {"backlash": play} if play else {})
    found: dict[str, Any] = execute("validate", validation(car, seed, runs, folder)).document["diagnosis"]
    return found


@pytest.mark.thorough  # a diagnosis of the full vehicle with play takes one to two minutes
@pytest.mark.parametrize(("seed", "play"), [(71, 5e-3), (72, 10e-3), (73, 15e-3), (74, 20e-3)])
def test_play_is_named_and_its_interval_holds_it(tmp_path: Path, seed: int, play: float) -> None:
    found = diagnosis(tmp_path, seed, play)
    assert found["verdict"] == "named"
    (cause,) = found["causes"]
    assert cause["effect"] == "backlash"
    low, high = cause["unknowns"]["backlash"]["interval95"]
    assert low <= play <= high
    assert high - low < 0.5 * play


@pytest.mark.thorough
def test_without_play_nothing_is_wrong(tmp_path: Path) -> None:
    assert diagnosis(tmp_path, 75, 0.0)["verdict"] == "adequate"
