"""The noise of the moment balance includes that of the derivatives in it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.plant.vehicle import random_vehicle
from tests.steps.cg.test_cg import logs
from vdyn_cli.steps.cg.load_windows import LoadWindows, cut_windows, with_smaller_loads
from vdyn_cli.steps.cg.local_derivative import SPAN, local_derivative
from vdyn_cli.steps.cg.noise import balance_covariance, noise_slopes


@pytest.fixture(scope="module")
def windows() -> LoadWindows:
    return cut_windows(logs(random_vehicle(4), 4)[0])


@pytest.mark.parametrize("order", [1, 2])
def test_a_derivative_is_integrated_as_its_samples_enter(windows: LoadWindows, order: int) -> None:
    values = np.random.default_rng(1).normal(size=windows.time.size)
    expected = windows.integral @ local_derivative(values, windows.step, SPAN, order)
    integral = windows.integral_rate if order == 1 else windows.integral_bend
    inner = slice(10, -10)  # ends have one-sided derivatives
    assert (integral @ values)[inner] == pytest.approx(expected[inner], rel=1e-9)


def test_the_band_holds_the_whole_covariance(windows: LoadWindows) -> None:
    rng = np.random.default_rng(2)
    bent = (*windows.loads, "acceleration")
    names = (*bent, "pitch_rate", "acceleration_rate", *(f"{n}_bend" for n in bent))
    slopes = noise_slopes(windows, {n: rng.normal(size=windows.first.size) for n in names})
    band = balance_covariance(windows, slopes)
    whole = sum(windows.noise[n] ** 2 * (slope @ slope.T).toarray() for n, slope in slopes.items())
    outside = np.tril(whole, -len(band))
    assert not outside.any()
    for j, row in enumerate(band):
        assert row[: row.size - j] == pytest.approx(np.diag(whole, -j), rel=1e-9)


@pytest.mark.parametrize("share", [0.0, 0.25])
def test_the_noise_of_an_axle_is_that_of_both_wheels_if_one_has_another_logger(share: float) -> None:
    """The one of its own clock, of 20 N, is interpolated at half a sample; a speed of few samples has no own level."""
    rng, log = np.random.default_rng(3), logs(random_vehicle(4), 4)[0]
    left, right = (0.5 * log["front_load"] + rng.normal(0.0, 20.0, log.time.size) for _ in range(2))
    read = np.interp(log.time, log.time + 0.005, right)
    log = log.with_channels(front_left_load=left, front_right_load=read, front_load=left + read)
    samples = {"front_right_load": (log.time + 0.005, right), "speed": (log.time[::400], log["speed"][::400])}
    made = with_smaller_loads(replace(log, samples=samples), share)
    expected = np.hypot(20.0 * 2**0.5, cut_windows(logs(random_vehicle(4), 4)[0]).noise["front_load"] / 2**0.5)
    assert cut_windows(made).noise["front_load"] == pytest.approx(expected / (1.0 + share), rel=0.05)
