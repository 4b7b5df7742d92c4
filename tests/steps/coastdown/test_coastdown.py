"""The coast-down step on the truth plant's days: recovery, other drives, slopes, traps and messages."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.coast_cases import known, logs_of, solve_day, spec_of
from tests.plant import coast, sensors
from tests.plant.vehicle import REFERENCE, random_vehicle
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.errors import InputError, ResultError, VdynError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.coastdown.problem import CoastdownProblem, prepare
from vdyn_cli.steps.coastdown.step import STEP

estimate = STEP.estimate
MAIN = ("rolling_resistance", "drag_area")
WINDOW: dict[str, Any] = {"speed_window": ["74 km/h", "21 km/h"]}
MORE = [pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3)]  # the same test of other cars or days


def off(result: Result, name: str, truth: float) -> float:
    """Error in standard deviations."""
    found = result.parameters[name]
    return (found.value - truth) / found.std


# Recovery -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [1, *MORE])
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


def test_a_third_term_is_found_where_it_is_asked_for() -> None:
    truth = 5e-5
    result = solve_day(
        REFERENCE, 6, coast.WIDE, {"speed_dependent_rolling": truth}, settings={"terms": 3, "speed_window": [35, 3]}
    )
    assert abs(off(result, "road_load_f1", truth * 1588 * 9.80665)) < 3.5
    assert result.parameters["road_load_f1"].source == "coastdown"


@pytest.mark.parametrize("seed", [1, 2])
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


def test_a_brake_in_a_driven_log_is_taken_out() -> None:
    runs = coast.campaign(REFERENCE, 3, coast.POWERED)
    logs = logs_of(runs, ("speed", "drive_torque"))
    logs[1] = braked(logs[1], 60.0, 63.0, 1.0)
    result = estimate(spec_of(runs), logs, known(REFERENCE, coast.POWERED))
    (entry,) = result.extra["rejected"]
    assert "brake" in entry["why"]
    assert entry["from_s"] < 60 < 63 < entry["to_s"] < 72
    assert len(result.fit.runs) == 9  # the braked one counts as two
    for name, truth in coast.truth(REFERENCE).items():
        assert abs(off(result, name, truth)) < 3.5


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
    with_grade = estimate(spec_of(runs), logs, known(REFERENCE))
    without = estimate(spec_of(runs), logs_of(runs), known(REFERENCE))
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
    (across,) = [f for f in result.findings if "coast_" not in f.where]  # the logs' own remarks apart
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


def test_the_regression_takes_effects() -> None:
    """What a diagnosis asks for: the same regression with another cause's unknowns in it."""
    from vdyn_cli.effects.headwind import headwind
    from vdyn_cli.inference import Unknown, solve

    runs = coast.campaign(REFERENCE, 2, coast.DAY, {"headwind": 3.0})
    wind = Unknown("headwind", 0.0, -8.0, 8.0, "m/s")
    solution = solve(prepare(spec_of(runs), logs_of(runs), known(REFERENCE)).regression((headwind,), (wind,)))
    low, high = solution.interval95["headwind"]
    assert low < 3.0 < high
    assert high - low < 2.0
    assert abs(solution.values["drag_area"] - 0.5475) < 4 * solution.std["drag_area"]


def test_a_problem_answers_the_same_whatever_was_requested_before() -> None:
    runs = coast.campaign(REFERENCE, 2)
    problem = prepare(spec_of(runs, settings=WINDOW), logs_of(runs), known(REFERENCE))
    before = problem.publish()
    regression = problem.regression()
    values = {u.name: u.start for u in regression.shared}
    assert [m.words(2) for m in problem.plans(regression, values)]
    assert problem.publish().parameters == before.parameters
    assert problem.duration == max(float(np.ptp(log.time)) for log in logs_of(runs))


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


# Runs that are left out ---------------------------------------------------------------------------------------------


def braked(log: Log, start: float, stop: float, deceleration: float) -> Log:
    """The driver brakes (or, negative, drives) between two times."""
    extra = np.cumsum(np.where((log.time >= start) & (log.time <= stop), deceleration, 0.0)) * 0.1
    return log.with_channels(speed=log["speed"] - extra)


def spoilt(change: Callable[[Log], Log]) -> CoastdownProblem:
    """A day whose third log is changed."""
    runs = coast.campaign(REFERENCE, 12)
    logs = logs_of(runs)
    logs[2] = change(logs[2])
    return prepare(spec_of(runs, settings=WINDOW), logs, known(REFERENCE))


def why(problem: CoastdownProblem) -> list[str]:
    return [entry.why for entry in problem.selection.rejected]


def test_a_run_that_is_braked_halfway_is_rejected() -> None:
    problem = spoilt(lambda log: braked(log, 40.0, 45.0, 1.0))
    (reason,) = why(problem)
    result = problem.publish()
    assert [entry["why"] for entry in result.extra["rejected"]] == [reason]
    assert "slows by" in reason
    assert "brake" in reason
    assert len(result.fit.runs) == 7
    assert abs(off(result, "rolling_resistance", 0.0095)) < 3.5
    (lost,) = [f for f in result.findings if "left out" in f.what]
    assert lost.doubt
    assert lost.what.startswith("1 of 8 runs not used; ")


def test_a_window_that_no_run_passes_is_said_with_the_speeds_of_the_runs() -> None:
    runs = coast.campaign(REFERENCE, 12)
    with pytest.raises(ResultError, match=r"the speed, 7\d.\d to [\d.]+ km/h, does not fall through any part"):
        prepare(spec_of(runs, settings={"speed_window": ["200 km/h", "180 km/h"]}), logs_of(runs), known(REFERENCE))


def test_runs_of_one_direction_that_are_not_used_are_said_to_be_there() -> None:
    runs = coast.campaign(REFERENCE, 12)
    logs = [
        log.with_channels(wind_speed=30.0 + 0 * log.time) if r.direction == "out" else log
        for r, log in zip(runs, logs_of(runs), strict=True)
    ]
    found = prepare(spec_of(runs, settings=WINDOW), logs, known(REFERENCE)).publish().findings
    (one_way,) = [f for f in found if "have the same direction" in f.what]
    assert "all runs used" in one_way.what
    assert "direction 'out'" in one_way.remedy
    assert sum(f.doubt and f.what.startswith("4 of 8 runs not used") for f in found) == 4


def test_a_brake_at_the_end_is_only_cut_off() -> None:
    problem = spoilt(lambda log: braked(log, 95.0, 99.0, 1.0))
    (entry,) = problem.selection.rejected
    assert "brake" in entry.why
    assert 88 < entry.start < 95
    assert len(problem.campaign.runs) == 8
    result = problem.publish()
    assert abs(off(result, "rolling_resistance", 0.0095)) < 3.5


def test_an_engaged_driveline_is_rejected() -> None:
    (reason,) = why(spoilt(lambda log: braked(log, 0.0, 500.0, 0.1)))
    assert "engaged driveline" in reason


def test_throttle_in_a_coast_is_cut_out() -> None:
    problem = spoilt(lambda log: braked(log, 30.0, 36.0, -0.6))
    (reason,) = why(problem)
    assert "throttle" in reason
    assert abs(off(problem.publish(), "rolling_resistance", 0.0095)) < 3.5


def test_a_wrong_reading_that_is_taken_back_is_no_throttle() -> None:
    def swing(log: Log) -> Log:
        phase = np.clip((log.time - 30.0) / 4.0, 0.0, 1.0)
        return log.with_channels(speed=log["speed"] + 1.5 * np.sin(np.pi * phase) ** 2)

    problem = spoilt(swing)
    assert not why(problem)
    assert abs(off(problem.publish(), "rolling_resistance", 0.0095)) < 3.5


def test_a_run_that_never_reaches_the_window_is_rejected() -> None:
    (reason,) = why(spoilt(lambda log: log.between(60.0, 500.0)))
    assert "less than 50 % of the speed window" in reason


def test_a_short_run_is_rejected() -> None:
    (reason,) = why(spoilt(lambda log: log.between(0.0, 1.0)))
    assert "samples" in reason


def test_missing_samples_are_skipped_and_a_gap_too_long_is_not_accepted() -> None:
    def holes(log: Log) -> Log:
        speed = log["speed"].copy()
        speed[::7] = np.nan
        return log.with_channels(speed=speed)

    def gap(log: Log) -> Log:
        speed = log["speed"].copy()
        speed[200:600] = np.nan
        return log.with_channels(speed=speed)

    assert not why(spoilt(holes))
    assert "missing" in why(spoilt(gap))[0]


def test_a_windy_run_is_rejected() -> None:
    def calm(log: Log) -> Log:
        return log.with_channels(wind_speed=np.zeros(log.time.size))

    runs = coast.campaign(REFERENCE, 12)
    logs = [calm(log) for log in logs_of(runs)]
    logs[3] = logs[3].with_channels(wind_speed=np.full(logs[3].time.size, -5.0))
    assert "mean wind 18 km/h" in why(prepare(spec_of(runs, settings=WINDOW), logs, known(REFERENCE)))[0]


def test_runs_of_one_direction_are_remarked_upon() -> None:
    runs = coast.campaign(REFERENCE, 3, coast.DAY.but(one_way=True))
    problem = prepare(spec_of(runs, settings=WINDOW), logs_of(runs), known(REFERENCE))
    assert any("all runs have the same direction" in f.what for f in problem.findings)


def test_a_steep_road_is_not_taken_for_a_brake() -> None:
    """0.8 % is 0.08 m/s^2 either way: out and back differ by half, but each agrees with its like."""
    runs = coast.campaign(REFERENCE, 3, coast.DAY, {"road_grade": 0.008})
    assert not why(prepare(spec_of(runs, settings=WINDOW), logs_of(runs), known(REFERENCE)))


# Messages -----------------------------------------------------------------------------------------------------------


def message(call: Callable[[], object], kind: type[VdynError]) -> str:
    with pytest.raises(kind) as caught:
        call()
    return str(caught.value)


def test_every_missing_parameter_is_named_at_once() -> None:
    runs = coast.campaign(REFERENCE, 1)
    few = known(REFERENCE, mass=None, air_density=None)
    text = message(lambda: estimate(spec_of(runs), logs_of(runs), few), InputError)
    assert "mass" in text
    assert "air_density" in text


def test_a_backward_sign_is_named_with_the_line_to_add() -> None:
    runs = coast.campaign(REFERENCE, 1, FELT)
    logs = logs_of(runs, ("speed", "acceleration"))
    for name in ("speed", "acceleration"):
        turned = [log.with_channels(**{name: -log[name]}) for log in logs]
        text = message(lambda turned=turned: estimate(spec_of(runs), turned, known(REFERENCE)), InputError)  # type: ignore[misc]
        assert name in text
        assert "sign: -1" in text


def test_a_backward_torque_is_named() -> None:
    runs = coast.campaign(REFERENCE, 1, coast.POWERED)
    logs = [g.with_channels(drive_torque=-g["drive_torque"]) for g in logs_of(runs, ("speed", "drive_torque"))]
    text = message(lambda: estimate(spec_of(runs), logs, known(REFERENCE, coast.POWERED)), InputError)
    assert "drive_torque" in text
    assert "sign: -1" in text


def test_nothing_left_says_why_run_by_run() -> None:
    settings = {"speed_window": ["160 km/h", "120 km/h"]}
    text = message(lambda: solve_day(REFERENCE, 1, settings=settings), ResultError)
    assert "run_1.csv" in text
    assert "speed window" in text


def test_powered_windows_need_a_drive() -> None:
    text = message(lambda: solve_day(REFERENCE, 1, settings={"windows": "powered"}), InputError)
    assert "drive_torque" in text


def test_with_everything_fixed_there_is_nothing_to_find() -> None:
    fix = {"drag_coefficient": 0.25, "rolling_resistance": 0.01}
    assert "no parameter is left" in message(lambda: solve_day(REFERENCE, 1, settings={"fix": fix}), InputError)


def test_one_run_alone_gives_an_answer_that_knows_its_limits() -> None:
    runs = coast.campaign(REFERENCE, 1, coast.WIDE.but(runs=1))
    result = estimate(spec_of(runs), logs_of(runs), known(REFERENCE))
    low, high = result.parameters["rolling_resistance"].interval95
    assert low < 0.0095 < high


def test_a_constant_speed_is_no_coast() -> None:
    time = np.arange(0.0, 60.0, 0.1)
    runs = coast.campaign(REFERENCE, 1, coast.DAY.but(runs=2))
    logs = [Log(f"run_{k}.csv", time, {"speed": np.full(time.size, 20.0)}) for k in (1, 2)]
    assert "not a coast-down" in message(lambda: estimate(spec_of(runs), logs, known(REFERENCE)), ResultError)


@settings(max_examples=6, deadline=None)
@given(
    st.integers(0, 2**31),
    st.sampled_from(["gap", "noise", "jump", "frozen", "short", "rising", "nan", "huge"]),
    st.sampled_from([("speed",), ("speed", "acceleration")]),
)
@example(1157, "noise", ("speed",))  # the noise hid that the car slows down
def test_damaged_logs_end_in_an_answer_or_a_message(seed: int, damage: str, channels: tuple[str, ...]) -> None:
    rng = np.random.default_rng(seed)
    runs = coast.campaign(REFERENCE, 21, FELT.but(runs=2))
    logs = [hurt(log, damage, rng) for log in logs_of(runs, channels)]
    with suppress(VdynError):
        result = estimate(spec_of(runs, settings=WINDOW), logs, known(REFERENCE))
        assert all(np.isfinite(e.value) for e in result.parameters.values())


def hurt(log: Log, damage: str, rng: np.random.Generator) -> Log:
    """What loggers do on a bad day."""
    speed, n = log["speed"].copy(), log.time.size
    at = int(rng.integers(n))
    if damage == "gap":
        speed[at : at + int(rng.integers(1, 600))] = np.nan
    elif damage == "noise":
        speed += rng.normal(0.0, 10 ** rng.uniform(-2, 1), n)
    elif damage == "jump":
        speed[at:] += rng.normal(0.0, 3.0)
    elif damage == "frozen":
        speed[at:] = speed[at]
    elif damage == "short":
        return log.between(0.0, float(log.time[max(at, 1)]))
    elif damage == "rising":
        speed = speed[::-1].copy()
    elif damage == "nan":
        speed[rng.random(n) < rng.uniform()] = np.nan
    else:
        speed[at] = 1e6
    return log.with_channels(speed=speed)
