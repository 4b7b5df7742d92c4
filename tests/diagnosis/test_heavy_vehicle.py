"""Ranges measured on cars grow with the mass of heavier vehicles, and stay for lighter ones."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.plant.other_classes import TRUCK, write_day
from vdyn_cli.effects import catalog, enlarged
from vdyn_cli.project.execute import execute

EFFECTS = {e.name: e for e in catalog()}


def test_only_amplitudes_of_cars_are_enlarged() -> None:
    brake = EFFECTS["brake_drag_fading"]
    truck = enlarged(brake, {"of_a_car": 4.0})
    assert truck.unknowns["brake_drag_fading"].upper == 4.0 * brake.unknowns["brake_drag_fading"].upper
    assert truck.unknowns["brake_drag_fading_time"] == brake.unknowns["brake_drag_fading_time"]
    assert enlarged(EFFECTS["driveline_viscous"], {"of_a_car": 4.0}).possible["driveline_viscous"][1] == 20.0
    assert enlarged(EFFECTS["headwind"], {"of_a_car": 4.0}) is EFFECTS["headwind"]
    assert enlarged(brake, {"of_a_car": 1.0}) is brake


@pytest.mark.slow  # a diagnosis of 4 s
def test_the_brakes_of_a_truck_let_go_slowly(tmp_path: Path) -> None:
    """1 500 N at first, five times what a car's brakes can drag."""
    force = 1500.0
    path = write_day(tmp_path, TRUCK, 0.0, 8, fading=force / (TRUCK.mass + TRUCK.rotating))
    result = execute("coastdown", path).result
    (cause,) = result.diagnosis.causes
    found = cause.unknowns["brake_drag_fading"]
    low, high = found.interval95
    assert abs(found.value - force) < 1.5 * (high - low) / 2  # 3 standard deviations: one seed
    low, high = result.parameters["drag_area"].interval95
    assert low < TRUCK.drag_area < high
