"""A steep road driven twice each way: all uphill runs slow more, which is a slope and no brake."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.plant.other_classes import HEAVY_EV, KART, TRUCK, Coaster, write_day
from vdyn_cli.project.execute import execute

LARGE = pytest.param(TRUCK, marks=[pytest.mark.slow, pytest.mark.thorough])  # a diagnosis of half a minute


@pytest.mark.slow  # a diagnosis of 3 s
@pytest.mark.parametrize("car", [LARGE, KART], ids=["truck", "kart"])
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


@pytest.mark.thorough
@pytest.mark.slow  # a diagnosis of 4 s
def test_runs_that_stop_slowing_down_on_the_way_back_are_used(tmp_path: Path) -> None:
    """Down 2 % the car rolls on at 90 km/h, a third of the speed window."""
    result = execute("coastdown", write_day(tmp_path, HEAVY_EV, 0.020, 6)).result
    assert len(result.fit.runs) == 4
    (cause,) = result.diagnosis.causes
    low, high = cause.unknowns["road_grade"].interval95
    assert low < 0.020 < high
    low, high = result.parameters["rolling_resistance"].interval95
    assert low < HEAVY_EV.rolling < high


def test_where_all_runs_of_one_direction_are_left_out_nothing_is_called_adequate(tmp_path: Path) -> None:
    """Down 6 % the car speeds up: what is left goes one way, whatever the description says."""
    result = execute("coastdown", write_day(tmp_path, HEAVY_EV, 0.060, 6, pairs=4)).result
    assert result.diagnosis.verdict == "not_testable"
    assert "same direction" in result.diagnosis.sentence
