"""The difference of two clocks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vdyn_cli.quantities.clock_difference import ClockDifference

CLOCK = ClockDifference("a", "b", ("speed", "speed"), 0.1, 3e-3, 50.0, 2e-5, 1e-4, False, 1.0, 0.0)


def test_a_drift_that_is_not_corrected_adds_to_the_error_of_the_delay() -> None:
    time = np.linspace(0.0, 100.0, 10_001)
    rms = 1e-4 * 100.0 / np.sqrt(12.0)
    assert CLOCK.run_delay_std(time) == pytest.approx(np.hypot(3e-3, rms), rel=1e-3)
    assert replace(CLOCK, corrected=True).run_delay_std(time) == 3e-3
    assert replace(CLOCK, drift_std=float("inf")).run_delay_std(time) == 3e-3
