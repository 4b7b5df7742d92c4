"""The interval of a mixture of normal distributions."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.inference.mixture import mixture_interval


def test_it_holds_95_percent_of_draws():
    rng = np.random.default_rng(3)
    draws = np.where(rng.random(400_000) < 0.2, rng.normal(5.0, 2.0, 400_000), rng.normal(0.0, 1.0, 400_000))
    low, high = mixture_interval((-1.96, 1.96), [(0.2, (1.08, 8.92))])
    assert np.mean(draws < low) == pytest.approx(0.025, abs=0.001)
    assert np.mean(draws > high) == pytest.approx(0.025, abs=0.001)


def test_of_one_answer_it_is_that_answers():
    assert mixture_interval((1.0, 3.0), []) == pytest.approx((1.0, 3.0))
