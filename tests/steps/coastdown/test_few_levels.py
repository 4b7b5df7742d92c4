"""Tables of split times: six speed levels a run give the answer of the whole log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

from tests.coast_cases import Array, known, logs_of, spec_of
from tests.messy_cases import prepared
from tests.plant import coast, messy_day, narrow_splits
from tests.plant.vehicle import random_vehicle
from vdyn_cli.diagnosis.diagnose import diagnosed
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.fit.road_load_regression import initial_regression, rows_of
from vdyn_cli.steps.coastdown.step import STEP

LEVELS = np.array([72.0, 63.0, 54.0, 45.0, 36.0, 27.0]) / 3.6
SPLIT = {"split_times": "elapsed"}


def split_table(log: Log, levels: Array) -> Log:
    """When the log last held each speed level, from its speed averaged over a second."""
    speed = uniform_filter1d(log["speed"], 1 + int(1.0 / np.median(np.diff(log.time))))
    times = [float(log.time[np.flatnonzero(speed >= v)[-1]]) for v in levels]
    return Log(log.name, np.array(times) - times[0], {"speed": levels})


@pytest.mark.slow  # a fit of the whole log each
@pytest.mark.parametrize("seed", [41, 42])
def test_six_levels_give_the_answer_of_the_whole_log(seed: int) -> None:
    vehicle = random_vehicle(seed)
    runs = coast.campaign(vehicle, seed)
    tables = [split_table(log, LEVELS) for log in logs_of(runs)]
    window = {"speed_window": ["72 km/h", "27 km/h"]}
    whole = STEP.estimate(spec_of(runs, settings=window), logs_of(runs), known(vehicle))
    few = STEP.estimate(spec_of(runs, reading=SPLIT), tables, known(vehicle))
    for name in ("rolling_resistance", "drag_area"):
        low, high = few.parameters[name].interval95
        assert low < whole.parameters[name].value < high
        assert high - low < 3.0 * np.ptp(whole.parameters[name].interval95)


def test_two_levels_are_too_few() -> None:
    vehicle = random_vehicle(43)
    runs = coast.campaign(vehicle, 43)
    tables = [split_table(log, LEVELS[:2]) for log in logs_of(runs)]
    with pytest.raises(ResultError, match="only 2 samples have a speed"):
        STEP.estimate(spec_of(runs, reading=SPLIT), tables, known(vehicle))


def test_no_shape_is_freer_than_the_levels_tell() -> None:
    """Narrower shapes follow each run's own start speed, by forces of thousands of newtons between the levels."""
    case = narrow_splits.drive(5, narrow_splits.Report(runs=4))
    problem = prepared(case, False, split_times=True).simulated_problem
    assert len(problem.profiles[0].unknowns) == len(narrow_splits.Report().levels) - 1
    assert {p.order for p in problem.parts if p.coordinate == "speed"} == {5}


@pytest.mark.slow  # a diagnosis of 3 s
@pytest.mark.parametrize("seed", [40009, 40014])
def test_a_narrow_range_of_speed_keeps_its_road_load(seed: int) -> None:
    report = narrow_splits.drawn_report(seed)
    ready = prepared(narrow_splits.drive(seed, report), False, split_times=True)
    base = ready.problem.publish()
    found = diagnosed(ready, base)
    assert found.diagnosis is not None
    assert found.diagnosis.verdict in ("adequate", "ambiguous")
    for one in ("rolling_resistance", "drag_area"):
        assert found.parameters[one].half_width < 2.0 * base.parameters[one].half_width


def test_a_road_acts_between_the_levels() -> None:
    """Heavy vehicles, 300 m from level to level, had a drag area at its bound when simulated on the slopes there."""
    day = messy_day.drive(4, messy_day.Day(upper=25.0, lower=5.0, runs=2))
    tables = [replace(r, time=r.time[::50], speed=r.speed[::50]) for r in day.runs]
    problem = prepared(replace(day, runs=tables), False, split_times=True).problem
    regression = initial_regression(problem.campaign)  # type: ignore[attr-defined]
    rows, slopes = rows_of(regression), np.sin(np.arange(len(rows_of(regression).road)))
    road = dict(zip(rows.road, slopes.tolist(), strict=True))
    theta = regression.local(regression.start(), 0)
    theta[rows.road_columns] = slopes
    assert np.allclose(rows.on_road(road).binned(0, theta)[0], rows.binned(0, theta)[0])
