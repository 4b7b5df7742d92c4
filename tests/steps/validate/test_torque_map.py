"""A torque that is wrong by a share that depends on speed lies in the torque's gain, and its curve is learned."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.steps.validate.validate_cases import inputs, prepared, true_parameters
from vdyn_cli.effects import catalog
from vdyn_cli.inference import Unknown
from vdyn_cli.project.execute import execute
from vdyn_cli.steps.added_effects import AddedEffects

MASS, RADIUS, ROLLING, DRAG_AREA, DENSITY = 1500.0, 0.31, 0.01, 0.6, 1.2
TOP = 32.0  # m/s
LOW, HIGH = 0.06, -0.04  # error of the torque at rest and at top speed
DESCRIPTION = f"""
test: validate
vehicle:
  mass: {MASS} +- 8 kg
  rotating_mass: 40 +- 2 kg
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
settings: {{model: road_load}}
runs:
"""


def drive(seed: int, way: float) -> np.ndarray:
    """Time, torque and speed at 10 Hz of 110 s with gusts, by Euler's method; the car has the torque times 1 + e(v)."""
    rng = np.random.default_rng([26, seed])
    step, v, gust, torque, rows = 0.02, rng.uniform(8.0, 16.0), 0.0, 0.0, []
    goals = np.repeat(rng.uniform(4.0, TOP, 12), 500)
    for k in range(5500):
        gust += -gust * step / 7.0 + 0.4 * np.sqrt(2 * step / 7.0) * rng.standard_normal()
        wanted = RADIUS * (MASS * np.clip(0.3 * (goals[k] - v), -0.8, 1.8) + 150.0 + 0.36 * v**2)
        torque += step / 0.3 * (wanted - torque)
        rows.append((k * step, torque, v))
        air = v + gust + 0.2 * way
        force = torque * (1.0 + LOW + (HIGH - LOW) * v / TOP) / RADIUS
        force -= MASS * 9.80665 * ROLLING + 0.5 * DENSITY * DRAG_AREA * air * abs(air)
        v += step * force / (MASS + 40.0)
    found = np.array(rows)[::5]
    return np.asarray(found + rng.standard_normal(found.shape) * [0.0, 1.5, 0.02])


@pytest.mark.slow  # a diagnosis
@pytest.mark.thorough
def test_a_torque_map_that_is_wrong_over_speed_is_found_as_a_curve_of_the_gain(tmp_path: Path) -> None:
    runs = ""
    for k, way in enumerate(("out", "back", "out", "back")):
        rows = drive(k, 1.0 if way == "out" else -1.0)
        np.savetxt(tmp_path / f"{k}.csv", rows, fmt="%.4f", delimiter=",", header="t,torque,speed", comments="")
        runs += f"  - {{log: {k}.csv, direction: {way}}}\n"
    (tmp_path / "test.yaml").write_text(DESCRIPTION + runs)
    diagnosis = execute("validate", tmp_path / "test.yaml").document["diagnosis"]
    assert (diagnosis["part"]["element"], diagnosis["part"]["coordinate"]) == ("drive_torque_gain", "speed")
    assert diagnosis["verdict"] == "data_fault"
    assert [c["effect"] for c in diagnosis["causes"]] == ["learned_drive_torque_gain"]
    curve = [(p["at"], p["value"]) for p in diagnosis["part"]["curve"]]
    slope = np.polyfit(*np.array(curve).T, 1)[0]
    assert slope == pytest.approx((HIGH - LOW) / TOP, rel=0.15)
    assert diagnosis["gain"]["after"] < diagnosis["gain"]["before"]


def test_the_torques_gain_is_a_part_over_speed_and_over_time(root: Path, tmp_path: Path) -> None:
    """Its constant scales the simulated torque."""
    problem = prepared(inputs(root, tmp_path, true_parameters(), (1,), model="road_load"))
    parts = [p for p in problem.parts if p.name == "drive_torque_gain"]
    assert [p.coordinate for p in parts] == ["speed", "elapsed"]
    part = parts[0]
    constant = Unknown(part.unknowns[0], 0.02, prior=(0.0, 1.0))
    rest = tuple(Unknown(n, 0.0, prior=(0.0, 1.0)) for n in part.unknowns[1:])
    free = problem.baseline.with_effects(AddedEffects((part.effect,), (constant, *rest)))
    speed = free.simulate(0, free.vector.start(0), slopes=False).values["speed"]
    base = problem.baseline.simulate(0, problem.baseline.vector.start(0), slopes=False).values["speed"]
    gain = next(e for e in catalog() if e.name == "torque_gain")
    size = Unknown("torque_gain", 1 / 1.02 - 1, prior=(0.0, 1.0))
    scaled = problem.baseline.with_effects(AddedEffects((gain,), (size,)))
    expected = scaled.simulate(0, scaled.vector.start(0), slopes=False).values["speed"]
    assert np.abs(expected - base).max() > 0.1
    assert speed == pytest.approx(expected, abs=1e-9)
