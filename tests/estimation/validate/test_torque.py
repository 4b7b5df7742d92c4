"""A torque without its noise: ramps stay ramps, corners corners."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.estimation.validate.torque import denoised

TIME = np.arange(0.0, 20.0, 0.01)
TRUE = np.interp(TIME, [0, 3, 3.15, 8, 8.2, 11, 11.1, 20], [0, 0, 300, 300, 20, 20, 250, 180])


def test_most_of_the_noise_goes_and_corners_stay() -> None:
    rng = np.random.default_rng(4)
    found = denoised(TIME, TRUE + rng.standard_normal(TIME.size), 1.0)
    error = found - TRUE
    assert np.sqrt(np.mean(error**2)) < 0.4
    assert np.abs(error).max() < 4.0
    steady = (TIME > 4.5) & (TIME < 7.0)
    assert np.std(error[steady]) < 0.2


def test_without_noise_nothing_is_changed() -> None:
    assert denoised(TIME, TRUE, 1e-3) == pytest.approx(TRUE, abs=0.02)


def test_it_works_the_same_backwards_in_time() -> None:
    noisy = TRUE + np.random.default_rng(5).standard_normal(TIME.size)
    backwards = denoised(-TIME[::-1], noisy[::-1], 1.0)[::-1]
    assert denoised(TIME, noisy, 1.0) == pytest.approx(backwards, abs=1e-9)
