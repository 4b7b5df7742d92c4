"""Statistics of arrays with missing values and outliers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vdyn_cli.quantities.arrays import median_deviation, rms
from vdyn_cli.quantities.parameters import normal_interval


def test_the_rms_of_several_arrays_leaves_out_missing_values() -> None:
    assert rms(np.array([3.0, np.nan]), 4.0) == pytest.approx(math.sqrt(12.5))
    assert math.isnan(rms(np.array([np.nan])))


def test_a_median_deviation_is_that_of_normal_residuals_beside_outliers() -> None:
    residuals = np.random.default_rng(1).normal(0.0, 2.0, 20_000)
    residuals[:200] = 1e3
    assert median_deviation(residuals) == pytest.approx(2.0, rel=0.03)


def test_a_normal_interval_holds_95_percent() -> None:
    low, high = normal_interval(5.0, 2.0)
    assert 0.5 * math.erfc(-(high - 5.0) / 2.0 / math.sqrt(2.0)) == pytest.approx(0.975)
    assert high - 5.0 == pytest.approx(5.0 - low)
