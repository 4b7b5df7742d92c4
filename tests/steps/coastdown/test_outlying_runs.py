"""An outlying run is reported, and a day without one has no such report."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.coast_cases import known, logs_of, spec_of
from tests.plant import coast
from tests.plant.vehicle import REFERENCE
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.coastdown.coasts.segments import longest_of_runs
from vdyn_cli.steps.coastdown.doubts import changed_runs
from vdyn_cli.steps.coastdown.doubts.odd_decelerations import RunDecelerations
from vdyn_cli.steps.coastdown.doubts.outlying_runs import (
    OutlyingRun,
    outlying_pair,
    outlying_run,
    resistance_step,
)
from vdyn_cli.steps.coastdown.doubts.partial_coasts import whole_coasts
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY
from vdyn_cli.steps.coastdown.step import STEP

EIGHT = coast.DAY.but(runs=8)
SLOW = pytest.mark.slow  # the same test of other days


def reported(result: Result) -> list[str]:
    return [f"{f.where} {f.what}" for f in result.findings if f.doubt]


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "odd"), [(5, 4), pytest.param(6, 0, marks=SLOW), pytest.param(7, 7, marks=SLOW)])
def test_a_brake_that_held_in_one_run_is_reported(seed: int, odd: int) -> None:
    runs = list(coast.campaign(REFERENCE, seed, EIGHT))
    runs[odd] = coast.campaign(REFERENCE, seed, EIGHT, {"brake_drag": 90.0})[odd]
    *_, found = reported(STEP.estimate(spec_of(runs), logs_of(runs), known(REFERENCE, EIGHT)))
    assert found.startswith(f"run_{odd + 1}.csv ")
    assert 60 < float(found.split("resistance is ")[1].split(" N")[0]) < 120


@pytest.mark.slow
@pytest.mark.parametrize("seed", [5, pytest.param(6, marks=SLOW), pytest.param(7, marks=SLOW)])
def test_an_undisturbed_day_has_no_outlier(seed: int) -> None:
    runs = coast.campaign(REFERENCE, seed, EIGHT)
    assert not reported(STEP.estimate(spec_of(runs), logs_of(runs), known(REFERENCE, EIGHT)))


@pytest.mark.slow
def test_the_level_is_kept_whatever_slope_wind_and_warming_do() -> None:
    random = np.random.default_rng(1)
    heading = np.tile([1.0, -1.0], 5)
    days = [random.normal(size=10) + 30 * heading - 4 * np.arange(10) for _ in range(4000)]
    found = [one for day in days if (one := outlying_run(day, heading, COASTDOWN_POLICY.outlying_run)) is not None]
    assert (
        0
        < sum(one.p_value < COASTDOWN_POLICY.outlier_level for one in found) / 4000
        < COASTDOWN_POLICY.outlier_level * 1.5
    )
    assert len(found) / 4000 < COASTDOWN_POLICY.outlying_run * 1.2


@pytest.mark.slow
def test_a_run_behind_another_car_is_found_at_high_speeds() -> None:
    """Its first 12 s take 9 s longer; the test of all speeds finds it with p = 0.3 at most."""
    runs = coast.campaign(REFERENCE, 5, EIGHT)
    logs = logs_of(runs)
    time = logs[4].time
    later = np.where(time < 12.0, 1.75 * time, time + 9.0)
    logs[4] = replace(logs[4], time=time, channels={"speed": np.interp(time, later, logs[4]["speed"])})
    problem = STEP.prepare(spec_of(runs), logs, known(REFERENCE, EIGHT))
    rates = RunDecelerations(whole_coasts(longest_of_runs(problem.selection.segments)), REFERENCE.mass)
    (found,) = rates.odd()
    assert found.segment.run == 4
    assert " less above " in found.fact


def test_few_runs_have_no_outlier() -> None:
    assert outlying_run(np.array([0.0, 1.0, 0.0, 1.0, 90.0]), np.ones(5)) is None


@pytest.mark.parametrize("step", [45.0, -60.0], ids=["a roof box", "a trailer whose mass is not stated"])
def test_a_step_of_the_force_is_found_at_its_run(step: float) -> None:
    """From the fifth of eight runs on, beside 6 N of scatter and a slope."""
    random = np.random.default_rng(4)
    heading = np.tile([1.0, -1.0], 4)
    days = [random.normal(0.0, 6.0, 8) + 20 * heading + step * (np.arange(8) >= 4) for _ in range(200)]
    found = [resistance_step(day, heading) for day in days]
    right = [f for f in found if f is not None and f.run == 4]
    assert len(right) > 170
    assert np.mean([f.force for f in right]) == pytest.approx(step, abs=2.0)


def test_two_successive_runs_that_hide_each_other_are_found() -> None:
    """A roof box on the fifth and sixth of eight runs, beside 3 N of scatter, a slope and a trend."""
    random = np.random.default_rng(5)
    heading, order = np.tile([1.0, -1.0], 4), np.arange(8)
    days = [random.normal(0.0, 3.0, 8) + 20 * heading + 2 * order + 40.0 * np.isin(order, (4, 5)) for _ in range(200)]
    found = [outlying_pair(day, heading) for day in days]
    assert sum(one is not None and one.run == 4 for one in found) > 150
    assert sum(outlying_run(day, heading) is not None for day in days) < 5


@pytest.mark.slow
@pytest.mark.parametrize("trend", ["none", "warming", "steady rise"])
def test_no_pair_is_found_where_there_is_none(trend: str) -> None:
    random = np.random.default_rng(6)
    heading, order = np.tile([1.0, -1.0], 4), np.arange(8)
    shape = {"none": 0.0 * order, "warming": 40.0 * np.exp(-order / 1.5), "steady rise": 6.0 * order}[trend]
    days = [random.normal(0.0, 6.0, 8) + 20 * heading + shape for _ in range(2000)]
    assert sum(outlying_pair(day, heading) is not None for day in days) / 2000 < 1.5 * COASTDOWN_POLICY.outlier_level


@pytest.mark.slow
@pytest.mark.parametrize("trend", ["none", "warming", "steady rise"])
def test_no_step_is_found_where_there_is_none(trend: str) -> None:
    random = np.random.default_rng(2)
    heading, order = np.tile([1.0, -1.0], 4), np.arange(8)
    shape = {"none": 0.0 * order, "warming": 40.0 * np.exp(-order / 1.5), "steady rise": 6.0 * order}[trend]
    days = [random.normal(0.0, 6.0, 8) + 20 * heading + shape for _ in range(2000)]
    found = sum(resistance_step(day, heading) is not None for day in days)
    assert found / 2000 < (0.06 if trend == "steady rise" else 1.5 * COASTDOWN_POLICY.outlier_level)


@pytest.mark.parametrize(("force", "is_reported"), [pytest.param(1.0, False, marks=SLOW), (30.0, True)])
def test_only_a_step_that_matters_is_reported(force: float, is_reported: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    step = OutlyingRun(4, force, 1e-4)
    monkeypatch.setattr(changed_runs, "resistance_step", lambda forces, headings, tests: step)
    runs = coast.campaign(REFERENCE, 5, EIGHT)
    found = reported(STEP.estimate(spec_of(runs), logs_of(runs), known(REFERENCE, EIGHT)))
    assert any("higher than before" in one for one in found) == is_reported


@pytest.mark.slow
def test_a_trailer_is_found_at_high_speeds_where_its_mass_hides_it_at_all_others() -> None:
    """From the fifth of eight runs on the mass is 40 % larger; drag and rolling resistance per weight are the same."""
    day = EIGHT.but(start_speed=34.0)
    towing = replace(REFERENCE, mass=1.4 * REFERENCE.mass)
    runs = [*coast.campaign(REFERENCE, 5, day)[:4], *coast.campaign(towing, 5, day)[4:]]
    result = STEP.estimate(spec_of(runs), logs_of(runs), known(REFERENCE, day))
    (found,) = [one for one in reported(result) if "than before" in one]
    assert found.startswith("run_5.csv from this run on the resistance above 87 km/h is 43 N lower than before")
    assert "; the earlier runs alone give rolling_resistance 0.0" in found
    low, high = result.parameters["drag_area"].interval95
    assert low < REFERENCE.drag_area / 1.4 < REFERENCE.drag_area < high
