"""The drag of a crosswind that was not measured is in the intervals, on the side to which it may be subtracted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.messy_cases import prepared
from tests.plant import messy_day
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.coastdown.doubts.crosswind import crosswind_force, crosswind_shift, likely_crosswind
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit, fit_road_load

DAY = messy_day.Day(rms=0.0, upper=25.0, lower=5.0, runs=4)
ROLLING = "rolling_resistance"


@pytest.fixture(scope="module")
def fits() -> tuple[RoadLoadFit, RoadLoadFit]:
    """A calm day and a day with gusts of 0.8 m/s, as in a mean wind of 4 m/s across the road."""
    winds = (messy_day.Weather(gust=0.15, drift=0.0), messy_day.Weather(gust=0.8, drift=0.0))
    days = [messy_day.drive(16, replace(DAY, weather=wind)) for wind in winds]
    calm, windy = (fit_road_load(prepared(day, False).problem.campaign_on_road) for day in days)  # type: ignore[attr-defined]
    return calm, windy


def published(stated: str, by_run: float | None = None) -> Result:
    problem = prepared(messy_day.drive(16, DAY), False, crosswind=stated).problem
    if by_run is not None:
        runs = [r.model_copy(update={"crosswind": Given(by_run)}) for r in problem.spec.runs]  # type: ignore[attr-defined]
        problem = replace(problem, spec=problem.spec.model_copy(update={"runs": runs}))  # type: ignore[attr-defined, call-arg, type-var]
    return problem.publish()


@pytest.mark.slow
def test_the_gusts_show_the_mean_wind(fits: tuple[RoadLoadFit, RoadLoadFit]) -> None:
    calm, windy = (likely_crosswind(fit) for fit in fits)
    assert calm < 1.2
    assert 3.0 < windy <= 5.0


def test_the_force_is_that_of_a_turned_flow_at_speed() -> None:
    at = {"air_density": 1.2, "drag_area": 0.7, "mass": 1500.0}
    (force,) = crosswind_force(at, np.array([30.0]), 3.0)
    flow, angle = np.hypot(30.0, 3.0), np.arctan(3.0 / 30.0)
    drag = 0.5 * 1.2 * 0.7 * (1.0 + 0.1 * (np.sin(angle) / np.sin(np.radians(10.0))) ** 2) * flow**2
    assert force == pytest.approx(drag * np.cos(angle) - 0.5 * 1.2 * 0.7 * 900.0, rel=0.01)
    (heavy,) = crosswind_force({**at, "mass": 20e3}, np.array([30.0]), 3.0)
    assert heavy == pytest.approx(7.5 / 3.8 * force, rel=0.01)


def test_a_windy_day_is_reported_and_a_calm_one_not(fits: tuple[RoadLoadFit, RoadLoadFit]) -> None:
    calm, windy = fits
    shift, (found,) = crosswind_shift(windy, None)
    speed = np.linspace(*windy.speeds, 50)
    added = float(np.mean(crosswind_force(windy.at, speed, likely_crosswind(windy))))
    assert shift[ROLLING] == pytest.approx(added / (windy.at["mass"] * 9.81), rel=0.2)
    assert "crosswind" in found.what
    assert "crosswind" in found.remedy
    assert crosswind_shift(calm, None)[1] == ()
    assert crosswind_shift(windy, 0.0) == ({}, ())


def test_intervals_are_longer_below_the_estimate_alone() -> None:
    calm, windy = published("0 m/s"), published("3 m/s")
    for name in (ROLLING, "road_load_f0"):
        without, included = calm.parameters[name], windy.parameters[name]
        assert included.value == without.value
        assert included.interval95[1] == pytest.approx(without.interval95[1])
        assert included.interval95[0] < without.interval95[0] - 0.3 * without.half_width
        assert included.std > without.std
    before, after = (r.extra["road_load"]["force"][1]["interval95"] for r in (calm, windy))
    assert after[0] < before[0]
    assert after[1] == pytest.approx(before[1])


@pytest.mark.slow
def test_runs_or_settings_state_it() -> None:
    by_settings, by_run = published("3 m/s"), published("1 m/s", by_run=3.0)
    assert by_run.parameters[ROLLING].interval95 == by_settings.parameters[ROLLING].interval95


def test_errors_of_the_speed_hide_a_share_of_weak_gusts(fits: tuple[RoadLoadFit, RoadLoadFit]) -> None:
    """The share grows steadily with an error that lasts for seconds and with rounding, up to usual gusts."""
    calm, windy = fits
    assert calm.sizes["gust"] < 0.5 < windy.sizes["gust"]

    def likely(fit: RoadLoadFit, **sizes: float) -> float:
        rows = fit.rows
        noise = replace(rows.noise, sizes={**rows.noise.sizes, **sizes})
        return likely_crosswind(replace(fit, regression=replace(fit.regression, rows=replace(rows, noise=noise))))

    by_drift = [likely(calm, speed_drift=error) for error in (0.0, 0.02, 0.04, 0.08, 10.0)]
    assert np.all(np.diff(by_drift) > 0.05)
    assert by_drift[-1] == pytest.approx(0.5 / 0.22, rel=0.01)
    assert likely(calm, speed_noise=20.0) > likely(calm) + 0.05
    assert likely(windy, speed_drift=10.0) == pytest.approx(likely(windy))
