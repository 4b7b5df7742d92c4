"""A torque logged before a lag, such as a command: the lag alone is named, and a delay remains a delay."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.bench.hidden_logs import make
from tests.plant.hidden import Scenario
from vdyn_cli.project.execute import execute

pytestmark = [pytest.mark.slow, pytest.mark.thorough]  # whole diagnoses of the full vehicle


@pytest.mark.parametrize(("effect", "size"), [("torque_lag", 0.05), ("torque_delay", 0.05)])
def test_a_lag_and_a_delay_are_each_named_alone(tmp_path: Path, effect: str, size: float) -> None:
    made = make(Scenario("validate", {effect: size}, 61), tmp_path)
    diagnosis = execute("validate", made.description).document["diagnosis"]
    (cause,) = diagnosis["causes"]
    assert cause["effect"] == effect
    low, high = cause["unknowns"][effect]["interval95"]
    assert low < size < high
