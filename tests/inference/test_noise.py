"""The level of white noise in a channel, and whitening of rows."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.inference import white_level, whiten

RNG = np.random.default_rng(0)
TIME = np.arange(4000) * 0.02
SMOOTH = 20 * np.exp(-TIME / 30) + np.sin(TIME)
NOISE = 0.05 * RNG.standard_normal(TIME.size)


def test_white_noise_on_a_smooth_signal() -> None:
    assert white_level(SMOOTH + NOISE) == pytest.approx(0.05, rel=0.05)


def test_a_tenth_of_outliers_changes_little() -> None:
    trace = SMOOTH + NOISE
    trace[::40] += 5.0
    assert white_level(trace) == pytest.approx(0.05, rel=0.15)


def test_missing_samples_are_skipped() -> None:
    trace = SMOOTH + NOISE
    trace[100:200] = np.nan
    assert white_level(trace, TIME) == pytest.approx(0.05, rel=0.05)


def test_uneven_samples_need_their_time() -> None:
    time = np.cumsum(RNG.uniform(0.002, 0.4, 4000))
    steep = 30 * time
    trace = steep + NOISE
    assert white_level(trace, time) == pytest.approx(0.05, rel=0.06)
    assert white_level(trace) > 1.0


def test_a_coarse_quantization_is_not_no_noise() -> None:
    step = 0.5
    slow = np.linspace(0, 3, 4000)
    assert 0.001 < white_level(np.round(slow / step) * step) < step


def test_too_short() -> None:
    with pytest.raises(ValueError, match="8 samples"):
        white_level(np.zeros(7))


def test_whitening_turns_a_covariance_into_one() -> None:
    n = 30
    distance = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    covariance = np.exp(-distance / 5) + 0.1 * np.eye(n)
    factor = np.linalg.cholesky(covariance)
    residual, jacobian = whiten(factor @ np.arange(n), factor @ np.ones((n, 2)), factor)
    assert residual == pytest.approx(np.arange(n), abs=1e-10)
    assert jacobian == pytest.approx(np.ones((n, 2)), abs=1e-10)
