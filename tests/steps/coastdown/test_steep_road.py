"""A steep road driven twice each way: all uphill runs slow more, which is a slope and no brake."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.plant.other_classes import KART, TRUCK, Coaster, write_day
from vdyn_cli.project.execute import execute


@pytest.mark.parametrize("car", [TRUCK, KART], ids=["truck", "kart"])
def test_two_runs_each_way_on_a_slope_of_one_per_cent(car: Coaster, tmp_path: Path) -> None:
    result = execute("coastdown", write_day(tmp_path, car, 0.010, 3)).result
    assert result.fit.runs == ("run0.csv", "run1.csv", "run2.csv", "run3.csv")
    (cause,) = result.diagnosis.causes
    low, high = cause.unknowns["road_grade"].interval95
    assert low < 0.010 < high
    low, high = result.parameters["rolling_resistance"].interval95
    assert low < car.rolling < high


@pytest.mark.parametrize("slope", [0.0, 0.010])
def test_one_dragging_run_of_two_is_left_out_on_a_slope_as_on_the_flat(slope: float, tmp_path: Path) -> None:
    path = write_day(tmp_path, KART, slope, 5, dragging={2: 0.2})
    runs = execute("coastdown", path, level=None).result.fit.runs
    assert runs == ("run0.csv", "run1.csv", "run3.csv")
