"""The drag of a crosswind that was not measured is in the intervals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.messy_cases import prepared
from tests.plant import messy_day
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.coastdown.doubts.crosswind import STRONGEST, crosswind_force, likely_crosswind, widened_by_crosswind
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit, fit_road_load

DAY = messy_day.Day(rms=0.0, upper=25.0, lower=5.0, runs=4)


@pytest.fixture(scope="module")
def fits() -> tuple[RoadLoadFit, RoadLoadFit]:
    """A calm day and a day with gusts of 1 m/s, as in a mean wind of 4 m/s."""
    winds = (messy_day.Weather(gust=0.15, drift=0.0), messy_day.Weather(gust=1.0, drift=0.0))
    days = [messy_day.drive(16, replace(DAY, weather=wind)) for wind in winds]
    calm, windy = (fit_road_load(prepared(day, False).problem.placed) for day in days)  # type: ignore[attr-defined]
    return calm, windy


def half(interval: tuple[float, float]) -> float:
    return 0.5 * (interval[1] - interval[0])


@pytest.mark.slow
def test_the_gusts_show_the_mean_wind(fits: tuple[RoadLoadFit, RoadLoadFit]) -> None:
    calm, windy = (likely_crosswind(fit) for fit in fits)
    assert calm < 1.2
    assert windy == STRONGEST


def test_the_force_is_that_of_a_turned_flow_at_speed() -> None:
    at = {"air_density": 1.2, "drag_area": 0.7}
    (force,) = crosswind_force(at, np.array([30.0]), 3.0)
    flow, angle = np.hypot(30.0, 3.0), np.arctan(3.0 / 30.0)
    drag = 0.5 * 1.2 * 0.7 * (1.0 + 0.1 * (np.sin(angle) / np.sin(np.radians(10.0))) ** 2) * flow**2
    assert force == pytest.approx(drag * np.cos(angle) - 0.5 * 1.2 * 0.7 * 900.0, rel=0.01)


def test_a_windy_day_has_wider_intervals_and_says_so(fits: tuple[RoadLoadFit, RoadLoadFit]) -> None:
    calm, windy = fits
    wider, (found,) = widened_by_crosswind(windy, None)
    speed = np.linspace(*windy.speeds, 50)
    lost = float(np.mean(crosswind_force(windy.at, speed, likely_crosswind(windy)))) / (windy.at["mass"] * 9.81)
    low, _ = wider.interval95["rolling_resistance"]
    assert low < windy.solution.values["rolling_resistance"] - 0.9 * lost
    assert "crosswind" in found.what
    assert "crosswind" in found.remedy
    assert widened_by_crosswind(calm, None)[1] == ()


def test_a_stated_crosswind_replaces_the_estimate(fits: tuple[RoadLoadFit, RoadLoadFit]) -> None:
    _, windy = fits
    assert widened_by_crosswind(windy, 0.0) == (windy.solution, ())
    widths = [half(widened_by_crosswind(windy, w)[0].interval95["rolling_resistance"]) for w in (1.0, 2.0, 4.0)]
    assert half(windy.solution.interval95["rolling_resistance"]) < widths[0] < widths[1] < widths[2]


def test_runs_or_settings_state_it() -> None:
    day = messy_day.drive(16, DAY)
    plain, stated = prepared(day, False).problem, prepared(day, False, crosswind="3 m/s").problem
    runs = [run.model_copy(update={"crosswind": Given(3.0)}) for run in plain.spec.runs]  # type: ignore[attr-defined]
    by_run = replace(plain, spec=plain.spec.model_copy(update={"runs": runs}))  # type: ignore[attr-defined]
    widths = [half(p.publish().parameters["rolling_resistance"].interval95) for p in (plain, stated, by_run)]
    assert widths[0] < widths[1] == widths[2]
