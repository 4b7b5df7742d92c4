"""Jerk from a specific force: right for smooth motion, its noise as the formula says."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.steps.validate.drives.jerk import CORNER, noise_gain, resolves_jerk, samples_alike, smooth_derivative

TIME = np.arange(0.0, 10.0, 0.01)
INNER = (TIME > 0.5) & (TIME < 9.5)


def test_a_straight_line_has_its_slope_and_a_slow_swing_its_derivative() -> None:
    line = smooth_derivative(TIME, 3.0 * TIME - 1.0)
    assert line[INNER] == pytest.approx(3.0)
    swing = smooth_derivative(TIME, np.sin(2 * np.pi * TIME))
    expected = 2 * np.pi * np.cos(2 * np.pi * TIME)
    assert swing[INNER] == pytest.approx(expected[INNER], abs=0.01 * 2 * np.pi)


def test_at_the_corner_three_decibels_are_gone() -> None:
    swing = smooth_derivative(TIME, np.sin(2 * np.pi * CORNER * TIME))
    size = np.sqrt(2) * np.std(swing[INNER])
    assert size == pytest.approx(2 * np.pi * CORNER / np.sqrt(2), rel=0.02)


def test_white_noise_comes_out_in_the_size_that_is_reckoned_with() -> None:
    noise = np.random.default_rng(1).standard_normal(200_000)
    time = np.arange(noise.size) * 0.01
    found = smooth_derivative(time, noise)
    assert np.std(found) == pytest.approx(noise_gain(time), rel=0.03)
    correlation = [np.corrcoef(found[:-k], found[k:])[0, 1] for k in range(1, 30)]
    assert samples_alike(time) == pytest.approx(1.0 + 2.0 * np.sum(np.square(correlation)), rel=0.1)


def test_columns_are_taken_one_by_one_and_slow_logs_have_none() -> None:
    both = np.column_stack([TIME, TIME**2])
    found = smooth_derivative(TIME, both)
    assert found[:, 1] == pytest.approx(smooth_derivative(TIME, TIME**2))
    assert resolves_jerk(TIME)
    assert not resolves_jerk(np.arange(0, 10, 0.1))
