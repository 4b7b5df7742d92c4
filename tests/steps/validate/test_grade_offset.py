"""A grade sensor with a wrong zero is named, and told from a wrong zero of the torque by an accelerometer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vdyn_cli.effects import catalog
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.physics.models.road_load import road_load
from vdyn_cli.project.execute import execute

MASS, RADIUS, ROLLING, DRAG_AREA, DENSITY = 1400.0, 0.31, 0.011, 0.62, 1.2
ZERO = 0.006  # reading of the grade sensor on a level road
DESCRIPTION = f"""
test: validate
vehicle:
  mass: {MASS} +- 8 kg
  rotating_mass: 35 +- 2 kg
  gear_ratio: 1
  wheel_radius: {RADIUS} +- 0.001 m
  driveline_efficiency: 1 +- 0.003
  rolling_resistance: {ROLLING} +- 0.0003
  drag_area: {DRAG_AREA} +- 0.015 m^2
  air_density: {DENSITY} kg/m^3
channels:
  time: {{column: t, unit: s}}
  drive_torque: {{column: torque, unit: N m}}
  speed: {{column: speed, unit: m/s}}
  acceleration: {{column: a, unit: m/s^2}}
  grade: {{column: grade, unit: "1"}}
settings: {{model: road_load}}
runs:
"""


def drive(seed: int, zero: float) -> np.ndarray:
    """Time, torque, speed, acceleration and grade at 10 Hz of 90 s over hills, by Euler's method."""
    rng = np.random.default_rng([41, seed])
    step, v, x, gust, torque, rows = 0.02, rng.uniform(8.0, 16.0), 0.0, 0.0, 0.0, []
    goals = np.repeat(rng.uniform(5.0, 28.0, 10), 500)
    phase = rng.uniform(0.0, 6.28)
    for k in range(4500):
        gust += -gust * step / 7.0 + 0.4 * np.sqrt(2 * step / 7.0) * rng.standard_normal()
        grade = 0.012 * np.sin(x / 90.0 + phase)
        wanted = RADIUS * (MASS * np.clip(0.3 * (goals[k] - v), -0.8, 1.8) + 150.0 + 0.36 * v**2)
        torque += step / 0.3 * (wanted - torque)
        weight = 9.80665 * np.sin(np.arctan(grade))
        force = torque / RADIUS - MASS * (9.80665 * ROLLING + weight) - 0.5 * DENSITY * DRAG_AREA * (v + gust) ** 2
        rate = force / (MASS + 35.0)
        rows.append((k * step, torque, v, rate + weight, grade + zero))
        v, x = v + step * rate, x + step * v
    found = np.array(rows)[::5]
    return np.asarray(found + rng.standard_normal(found.shape) * [0.0, 1.5, 0.02, 0.03, 2e-4])


def diagnosis_of(folder: Path, zero: float) -> dict[str, object]:
    runs = ""
    for k, way in enumerate(("out", "back", "out", "back")):
        rows = drive(k, zero)
        np.savetxt(folder / f"{k}.csv", rows, fmt="%.5f", delimiter=",", header="t,torque,speed,a,grade", comments="")
        runs += f"  - {{log: {k}.csv, direction: {way}}}\n"
    (folder / "test.yaml").write_text(DESCRIPTION + runs)
    return execute("validate", folder / "test.yaml").document["diagnosis"]


@pytest.mark.slow  # a diagnosis
@pytest.mark.thorough
def test_a_wrong_zero_of_the_grade_sensor_is_named_with_its_size(tmp_path: Path) -> None:
    diagnosis = diagnosis_of(tmp_path, ZERO)
    assert diagnosis["verdict"] == "data_fault"
    assert [c["effect"] for c in diagnosis["causes"]] == ["grade_offset"]
    low, high = diagnosis["causes"][0]["unknowns"]["grade_offset"]["interval95"]
    assert low < ZERO < high
    assert high - low < ZERO


@pytest.mark.slow  # a diagnosis
@pytest.mark.thorough
def test_a_right_zero_of_the_grade_sensor_is_adequate(tmp_path: Path) -> None:
    assert diagnosis_of(tmp_path, 0.0)["verdict"] == "adequate"


def test_a_grade_without_a_sensor_has_no_zero() -> None:
    one = tuple(e for e in catalog() if "logged_grade" in e.laws)
    assert one
    assert not applicable(road_load("torque"), one)
    assert applicable(road_load("torque", graded="sensor"), one) == one
