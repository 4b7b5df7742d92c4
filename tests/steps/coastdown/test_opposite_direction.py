"""A run whose deceleration is that of the opposite direction is named with it, and a braked run is not."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.steps.coastdown.coasts.opposite_direction import fits_opposite

WAYS = ["out", "back", "out", "back", "out", "back", "out", "back"]


@pytest.mark.parametrize(
    ("rate", "expected"), [(0.46, "back"), (0.44, "back"), (0.60, None), (0.52, None), (0.70, None), (0.20, None)]
)
def test_a_run_out_is_compared_with_the_runs_of_both_directions(rate: float, expected: str | None) -> None:
    rates = np.array([0.59, 0.45, rate, 0.46, 0.57, 0.44, 0.60, 0.47])
    assert fits_opposite(rates, WAYS, 2) == expected


def test_one_other_run_of_a_direction_is_no_comparison() -> None:
    assert fits_opposite(np.array([0.46, 0.45, 0.60, 0.46]), WAYS[:4], 0) is None
    assert fits_opposite(np.array([0.46, 0.45, 0.60, 0.46]), [None] * 4, 0) is None
