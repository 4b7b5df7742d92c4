"""Runs in one direction: a slope or a wind that they cannot show is in the intervals, and the user is warned."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.bench import cases
from tests.messy_cases import prepared
from tests.plant import coast, messy_day
from tests.plant.vehicle import random_vehicle
from vdyn_cli.project.execute import execute


@pytest.fixture(scope="module")
def one_way():
    case = messy_day.drive(41, messy_day.drawn_day("clean", 41))
    return replace(case, runs=tuple(r for r in case.runs if r.direction == "out"))


def test_the_intervals_hold_a_slope_and_a_wind(one_way):
    found = prepared(one_way, False).problem.publish()
    low, high = found.parameters["rolling_resistance"].interval95
    assert 0.5 * (high - low) == pytest.approx(0.0058, abs=0.0008)  # a slope of 0.5 % and a wind of 3 m/s, in squares
    low, high = found.parameters["drag_area"].interval95
    assert 0.5 * (high - low) > 0.05
    (warned,) = [f for f in found.findings if "same direction" in f.what]
    assert warned.doubt


def test_a_stated_road_is_known(one_way):
    found = prepared(one_way, False, road={"roughness": "0.05 %"}).problem.publish()
    low, high = found.parameters["rolling_resistance"].interval95
    assert 0.5 * (high - low) < 0.004


@pytest.mark.slow  # a Monte Carlo run or several fits
def test_runs_there_and_back_are_as_before():
    case = messy_day.drive(41, messy_day.drawn_day("clean", 41))
    found = prepared(case, False).problem.publish()
    low, high = found.parameters["rolling_resistance"].interval95
    assert 0.5 * (high - low) < 0.002


def test_three_runs_in_a_wind_hold_the_truth(tmp_path):
    vehicle = random_vehicle(1)
    path = cases.coast_downs(vehicle, 1, tmp_path, coast.WIDE.but(rate=5.0, runs=3), False, {"headwind": 1.5})
    found = execute("coastdown", path, level=None).result
    (warned,) = [f for f in found.findings if "do not cancel" in f.what]
    assert warned.what.startswith("2 out and 1 back")
    assert warned.remedy == "drive 1 more back"
    for name in ("rolling_resistance", "drag_area"):
        low, high = found.parameters[name].interval95
        assert low < getattr(vehicle, name) < high
