"""How accurate coasts between two speeds will be, before they are driven."""

from __future__ import annotations

import numpy as np
import pytest

from tests.coast_cases import solve_day
from tests.plant import coast
from tests.plant.vehicle import REFERENCE
from vdyn_cli.steps.coastdown.campaign_checks.expected_accuracy import CoastSetup, expected_accuracy, wider_window

CAR = {"mass": 1588.0, "rotating_mass": 87.5, "rolling_resistance": 0.0095, "rolling_speed": 0.0}
CAR |= {"drag_area": 0.5475, "air_density": 1.225, "wind_variance": 0.4}
GUSTS = {"speed_noise": 1.0, "gust": 0.6, "gust_time": 8.0, "run_wind": 0.3, "run_force": 1e-3}
STILL = {"speed_noise": 1.0, "gust": 0.0, "gust_time": 8.0, "run_wind": 0.0, "run_force": 0.0}


def test_in_still_air_a_narrow_window_hardly_separates() -> None:
    """The paper's 70 to 25 km/h: correlated by -0.98, which is why the drag coefficient was fixed there."""
    found = expected_accuracy(CoastSetup(CAR, STILL, 0.03, 0.1, 6), (70 / 3.6, 25 / 3.6))
    assert found.correlation < -0.95


def test_more_runs_tell_more_and_a_wider_window_tells_them_apart() -> None:
    few, many = (expected_accuracy(CoastSetup(CAR, GUSTS, 0.03, 0.1, n), (20.0, 7.0)) for n in (4, 16))
    assert few.rolling == pytest.approx(2 * many.rolling)
    wide = expected_accuracy(CoastSetup(CAR, GUSTS, 0.03, 0.1, 4), (36.0, 2.0))
    assert wide.rolling < few.rolling
    assert wide.drag < 0.5 * few.drag


def test_the_least_widening_that_does_is_proposed() -> None:
    window = (70 / 3.6, 40 / 3.6)
    setup = CoastSetup(CAR, GUSTS, 0.03, 0.1, 4)
    now, better = expected_accuracy(setup, window), wider_window(setup, window)
    assert max(now.rolling, now.drag) > 0.03
    assert better is not None
    assert max(better.rolling, better.drag) <= 0.03
    assert better.upper >= window[0]
    assert better.lower <= window[1]


@pytest.mark.slow  # a Monte Carlo run or several fits
def test_what_is_expected_is_what_comes_out() -> None:
    level = {"road": {"roughness": "0 %"}, "crosswind": "0 m/s"}  # what is expected is that of a level road in calm air
    results = [solve_day(REFERENCE, seed, coast.DAY, settings=level) for seed in range(4)]
    now = results[0].extra["separation"]["now"]
    for name in ("rolling_resistance", "drag_area"):
        came = np.sqrt(np.mean([(r.parameters[name].std / r.parameters[name].value) ** 2 for r in results]))
        assert came == pytest.approx(now[f"{name}_relative_std"], rel=0.35)
