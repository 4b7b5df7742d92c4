"""Rolling resistance and drag area may have absorbed an unknown share of a learned law of the resistance."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.plant.other_classes import HEAVY_EV, write_day
from vdyn_cli.project.execute import execute


@pytest.mark.slow  # a diagnosis of 5 s
def test_a_car_that_sheds_drag_at_speed_keeps_its_parameters_within_their_intervals(tmp_path: Path) -> None:
    """Grille shutters reduce the drag by a quarter above 80 km/h, so that one drag area fits the coast badly."""
    car = replace(HEAVY_EV, shed=0.25)
    result = execute("coastdown", write_day(tmp_path, car, 0.0, 2, pairs=3)).result
    assert result.diagnosis.verdict in ("named", "unknown")
    assert result.diagnosis.part.element == "road_load"
    for name, truth in (("rolling_resistance", car.rolling), ("drag_area", car.drag_area)):
        low, high = result.parameters[name].interval95
        assert low < truth < high
