"""The coast-down step on the truth plant's days: recovery, other drives, slopes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.coast_cases import known, logs_of, off, solve_day, spec_of
from tests.plant import coast, sensors
from tests.plant.vehicle import REFERENCE, random_vehicle
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.coastdown.preparation import prepare
from vdyn_cli.steps.coastdown.step import STEP

estimate = STEP.estimate
MAIN = ("rolling_resistance", "drag_area")
WINDOW: dict[str, Any] = {"speed_window": ["74 km/h", "21 km/h"]}
MORE = [pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3)]  # the same test of other cars or days


# Recovery -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [pytest.param(1, marks=pytest.mark.slow), *MORE])  # fast: the sample's truth
def test_coasts_of_random_vehicles(seed: int) -> None:
    vehicle = random_vehicle(seed)
    result = solve_day(vehicle, seed, settings=WINDOW)
    for name, truth in coast.truth(vehicle).items():
        assert abs(off(result, name, truth)) < 3.5
        assert result.parameters[name].std < 0.06 * truth
    assert result.fit.interval_unit == "run"
    assert result.parameters["drag_coefficient"].value == pytest.approx(
        result.parameters["drag_area"].value / vehicle.frontal_area
    )


@pytest.mark.slow
def test_calm_air_and_good_sensors_give_the_truth() -> None:
    day = coast.QUIET.but(speed=sensors.Sensor(noise=0.002))
    result = solve_day(REFERENCE, 4, day, settings=WINDOW)
    for name, truth in coast.truth(REFERENCE).items():
        assert result.parameters[name].value == pytest.approx(truth, rel=2e-3)
    assert result.extra["road_load"]["corrected"] is None  # its temperature is not known
    assert any("not corrected" in f.what for f in result.findings)


def test_the_papers_way_fixes_the_drag_coefficient() -> None:
    result = solve_day(REFERENCE, 5, settings=WINDOW | {"fix": {"drag_coefficient": 0.25}})
    assert result.parameters["drag_area"].source == "given"
    assert result.parameters["drag_area"].value == pytest.approx(0.25 * 2.19)
    assert abs(off(result, "rolling_resistance", 0.0095)) < 3.5
    assert "would be correlated" in result.extra["separation"]["words"]
    assert "drag area fixed at 0.5475 m^2" in result.sentence


@pytest.mark.slow
def test_a_third_term_is_found_where_it_is_asked_for() -> None:
    truth = 5e-5
    result = solve_day(
        REFERENCE, 6, coast.WIDE, {"speed_dependent_rolling": truth}, settings={"terms": 3, "speed_window": [35, 3]}
    )
    assert abs(off(result, "road_load_f1", truth * 1588 * 9.80665)) < 3.5
    assert result.parameters["road_load_f1"].source == "coastdown"


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_any_drive_with_known_torque_will_do(seed: int) -> None:
    vehicle = random_vehicle(seed)
    result = solve_day(vehicle, seed, coast.POWERED, channels=("speed", "drive_torque"))
    for name, truth in coast.truth(vehicle).items():
        assert abs(off(result, name, truth)) < 3.5
        assert result.parameters[name].std < 0.1 * truth


def test_force_is_as_good_as_torque() -> None:
    runs = coast.campaign(REFERENCE, 3, coast.POWERED)
    logs = logs_of(runs, ("speed", "drive_torque"))
    by_torque = estimate(spec_of(runs), logs, known(REFERENCE, coast.POWERED))
    forces = [
        Log(g.name, g.time, {"speed": g["speed"], "drive_force": g["drive_torque"] * 3.267 / 0.308}) for g in logs
    ]
    by_force = estimate(spec_of(runs), forces, known(REFERENCE, coast.POWERED, gear_ratio=None, wheel_radius=None))
    for name in MAIN:
        assert by_force.parameters[name].value == pytest.approx(by_torque.parameters[name].value, rel=1e-6)


HILLY = {"grade_profile": 0.01}
FELT = coast.DAY.but(acceleration=sensors.ACCELEROMETER)


@pytest.mark.slow  # four fits with gusts
def test_an_accelerometer_takes_the_slope_out() -> None:
    both, days = ("speed", "acceleration"), (1, 2)
    blind = [solve_day(REFERENCE, seed, FELT, HILLY, settings=WINDOW) for seed in days]
    seeing = [solve_day(REFERENCE, seed, FELT, HILLY, both, settings=WINDOW) for seed in days]
    for name, truth in coast.truth(REFERENCE).items():
        assert all(abs(off(one, name, truth)) < 4 for one in seeing)
        # On a day whose hills the speed alone shows well, it is as exact.
        spread = [np.hypot(*(one.parameters[name].std for one in each)) for each in (seeing, blind)]
        assert spread[0] < 0.75 * spread[1]


@pytest.mark.slow
def test_an_accelerometer_on_a_flat_road_does_no_harm() -> None:
    blind, seeing = (solve_day(REFERENCE, 7, FELT, channels=c) for c in (("speed",), ("speed", "acceleration")))
    for name in MAIN:
        assert seeing.parameters[name].value == pytest.approx(blind.parameters[name].value, rel=0.02)


@pytest.mark.slow
def test_a_known_grade_is_reckoned_with() -> None:
    runs = coast.campaign(REFERENCE, 8, coast.DAY, {"road_grade": 0.004})
    logs = [
        log.with_channels(grade=np.full(log.time.size, 0.004 if run.direction == "out" else -0.004))
        for run, log in zip(runs, logs_of(runs), strict=True)
    ]
    calm = spec_of(runs, settings={"crosswind": "0 m/s"})  # else its drag is most of either interval
    with_grade = estimate(calm, logs, known(REFERENCE))
    without = estimate(calm, logs_of(runs), known(REFERENCE))
    # An unknown constant slope is part of the random road: it widens the interval less than a force of no direction.
    assert with_grade.parameters["rolling_resistance"].std < 0.6 * without.parameters["rolling_resistance"].std
    assert abs(off(with_grade, "rolling_resistance", 0.0095)) < 3.5


# What is published --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def sample(root: Path) -> Result:
    """The sample day's road load; what its diagnosis finds is a test of the whole day."""
    return execute("coastdown", root / "configs" / "coastdown.yaml", level=None).result


def test_the_sample_logs_give_their_truth(sample: Result) -> None:
    result = sample
    for name, truth in (("rolling_resistance", 0.0095), ("drag_area", 0.5475)):
        low, high = result.parameters[name].interval95
        assert low < truth < high
    load, corrected = result.extra["road_load"]["tested"], result.extra["road_load"]["corrected"]
    assert load["F0_N"] == pytest.approx(0.0095 * 1588 * 9.80665, rel=0.03)
    assert corrected["F0_N"] == pytest.approx(load["F0_N"] * (1 + 8.6e-3 * 4), rel=1e-9)
    assert load["A_lbf"] == pytest.approx(load["F0_N"] / 4.4482216)
    accuracy = result.extra["accuracy"]
    assert accuracy["pairs"] == 4
    assert 0 < accuracy["r83"]["worst"] == accuracy["wltp"]["worst"] < 0.05
    assert {t.key for t in result.tables} == {"coefficients", "forces", "times", "influence"}
    assert 2 <= len(result.figures) <= 5
    assert len(result.comparisons) == 8
    across, mass = (f for f in result.findings if "coast_" not in f.where)  # the logs' own remarks apart
    assert mass.where == "vehicle.mass"
    assert "collinear" in mass.what
    assert "no crosswind is stated" in across.what
    assert set(STEP.gives) - {"drag_coefficient"} <= set(result.parameters)


def test_runs_predict_each_other(sample: Result) -> None:
    fit = sample.fit
    assert fit.held_out_rms is not None
    assert fit.rms < fit.held_out_rms < 1.5 * fit.rms


def test_times_agree_with_the_fitted_force(sample: Result) -> None:
    (table,) = [t for t in sample.tables if t.key == "times"]
    for row in table.rows:
        assert float(row[-2]) == pytest.approx(float(row[-1]), rel=0.04)


@pytest.mark.slow  # six fits
def test_uncertain_mass_widens_the_interval() -> None:
    runs = coast.campaign(REFERENCE, 9)
    sure = known(REFERENCE)
    unsure = replace(sure, estimates={**sure.estimates, "mass": replace(sure["mass"], std=0.03 * 1588)})
    narrow, wide = (estimate(spec_of(runs), logs_of(runs), k) for k in (sure, unsure))
    for name in ("drag_area", "road_load_f0"):
        by_mass = wide.parameters[name].std ** 2 - narrow.parameters[name].std ** 2
        assert np.sqrt(by_mass) == pytest.approx(0.03 * narrow.parameters[name].value, rel=0.1)


def test_plain_least_squares_weighs_a_prior_as_it_should() -> None:
    runs = coast.campaign(REFERENCE, 9)
    sure = known(REFERENCE)
    unsure = replace(sure, estimates={**sure.estimates, "mass": replace(sure["mass"], std=0.03 * 1588)})
    result = estimate(spec_of(runs, settings={"noise": "white"}), logs_of(runs), unsure)
    drag = result.parameters["drag_area"]
    assert drag.std > 0.03 * drag.value
    assert drag.value == pytest.approx(0.5475, rel=0.12)


def test_turning_parts_are_assumed_aloud() -> None:
    runs = coast.campaign(REFERENCE, 1)
    problem = prepare(spec_of(runs), logs_of(runs), known(REFERENCE, rotating_mass=None))
    assert any("rotating_mass is not given" in f.what for f in problem.findings)


@pytest.mark.slow
def test_the_regression_takes_effects() -> None:
    """What a diagnosis asks for: the same regression with another cause's unknowns in it."""
    from vdyn_cli.effects.headwind import headwind
    from vdyn_cli.inference import Unknown, solve

    runs = coast.campaign(REFERENCE, 2, coast.DAY, {"headwind": 3.0})
    wind = Unknown("headwind", 0.0, -8.0, 8.0, "m/s")
    solution = solve(
        prepare(spec_of(runs), logs_of(runs), known(REFERENCE)).regression(AddedEffects((headwind,), (wind,)))
    )
    low, high = solution.interval95["headwind"]
    assert low < 3.0 < high
    assert high - low < 2.0
    assert abs(solution.values["drag_area"] - 0.5475) < 4 * solution.std["drag_area"]


@pytest.mark.slow
def test_a_problem_answers_the_same_whatever_was_requested_before() -> None:
    runs = coast.campaign(REFERENCE, 2)
    problem = prepare(spec_of(runs, settings=WINDOW), logs_of(runs), known(REFERENCE))
    before = problem.publish()
    regression = problem.regression()
    values = {u.name: u.start for u in regression.shared}
    assert [m.words(2) for m in problem.plans(regression, values)]
    assert problem.publish().parameters == before.parameters


@pytest.mark.slow
def test_a_speed_that_was_joined_by_straight_lines_counts_as_often_as_it_was_measured() -> None:
    runs = coast.campaign(REFERENCE, 12)
    logs = [_evenly(log) for log in logs_of(runs)]
    joined = [_joined(log) for log in logs]
    plain, found = (estimate(spec_of(runs, settings=WINDOW), some, known(REFERENCE)) for some in (logs, joined))
    for name in ("rolling_resistance", "drag_area"):
        assert found.parameters[name].value == pytest.approx(plain.parameters[name].value, rel=1e-3)
        assert found.parameters[name].std == pytest.approx(plain.parameters[name].std, rel=0.05)


def _evenly(log: Log) -> Log:
    """On an even clock, as loggers write what they have joined."""
    time = log.time[0] + 0.1 * np.arange(log.time.size)
    return Log(log.name, time, {"speed": np.round(np.interp(time, log.time, log["speed"]), 4)})


def _joined(log: Log) -> Log:
    time = log.time[0] + 0.01 * np.arange(10 * log.time.size - 9)
    return Log(log.name, time, {"speed": np.round(np.interp(time, log.time, log["speed"]), 4)})
