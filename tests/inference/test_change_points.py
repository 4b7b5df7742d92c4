"""The likeliest change of level in a short sequence, and its chance in a sequence of one level."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.inference.change_points import level_change


def test_two_levels_are_found_with_their_ratio() -> None:
    found = level_change([2.0, 2.02, 1.98, 2.2, 2.22, 2.18], 2)
    assert found is not None
    assert found.first == 3
    assert found.ratio == pytest.approx(1.1)
    assert found.chance < 0.01
    assert found.over_line < 0.5


def test_of_sequences_of_one_level_no_more_have_a_change_than_stated() -> None:
    rng = np.random.default_rng(3)
    chances = [found.chance for _ in range(300) if (found := level_change(rng.normal(1.0, 0.1, 6), 2))]
    assert len(chances) == 300
    assert np.mean(np.array(chances) < 0.1) <= 0.1


def test_a_drift_leaves_less_about_a_line() -> None:
    found = level_change([1.0, 1.1, 1.21, 1.29, 1.4, 1.52], 2)
    assert found is not None
    assert found.over_line > 1.0


def test_too_few_or_missing_values_show_none() -> None:
    assert level_change([1.0, 1.0, 2.0, 2.0], 2) is None
    assert level_change([1.0, 1.0, np.nan, 2.0, 2.0], 2) is None
    assert level_change([1.0] * 6, 2) is None


def test_a_value_that_is_missing_is_left_out() -> None:
    found = level_change([1.0, 1.0, np.nan, 1.0, 2.0, 2.0], 2)
    assert found is not None
    assert (found.first, found.ratio) == (4, 2.0)
    assert found.chance < 1e-6
