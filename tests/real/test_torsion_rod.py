"""The torsion rod of the bicycle measurements: its drawing, its calibration bar, and a wheel that swings on it."""

from __future__ import annotations

import math
from pathlib import Path
from statistics import mean

import numpy as np
import pytest

from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.pendulum.pendulum_fit import Recording, free_swing
from vdyn_cli.steps.shaft.sections import compliance
from vdyn_cli.steps.shaft.spec import ShaftSpec
from vdyn_cli.steps.shaft.step import STEP


def measured(folder: Path, file: str) -> dict[str, float]:
    """Mean of the readings of each quantity of the table."""
    lines = (folder / "pendulum_bicycle" / file).read_text(encoding="utf-8").splitlines()
    pairs = (line.split("=") for line in lines if "=" in line and not line.startswith("#"))
    return {name.strip(): mean(float(x.split("+/-")[0]) for x in values.split(",")) for name, values in pairs}


def test_bar_and_drawing_give_11_7(shared_data: Path) -> None:
    table = measured(shared_data, "RigidMeasured.txt")
    bar = {"mass": table["mP"], "length": table["lP"], "diameter": table["dP"], "period": table["TtP1"]}
    spec = ShaftSpec.model_validate({"test": "shaft", "pendulum": {"left": bar}})
    stiffness = STEP.estimate(spec, (), Parameters()).parameters["shaft_stiffness_left"].value
    assert stiffness == pytest.approx(11.67, abs=0.005)
    assert 1 / compliance(0.00635, 0.0, 1.05, 77e9) == pytest.approx(11.71, abs=0.005)


def test_the_wheel_swinging_on_the_rod_agrees(shared_data: Path) -> None:
    table = measured(shared_data, "RigidMeasured.txt")
    name = "bicycle-wheel-radial-inertia-rate-gyro-measurement.csv"
    path = shared_data / "pendulum_bicycle" / name
    time, rate = np.loadtxt(path, delimiter=",", skiprows=1, unpack=True)
    recording = Recording.of(Log(name, time, {"angular_rate": rate}), "torsional", {})
    period = free_swing(recording).solution.values["period"]
    assert period == pytest.approx(table["TtF1"], rel=1e-3)
    inertia = measured(shared_data, "RigidBenchmark.txt")["IFxx"]
    assert inertia * (2 * math.pi / period) ** 2 == pytest.approx(11.67, abs=0.02)
