"""The difference of two clocks."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.quantities.clock_difference import ClockDifference

DRIFT = {"drift": 2e-5, "drift_std": 1e-4, "corrected": False, "gain": 1.0, "offset": 0.0, "channels": ()}
CLOCK = ClockDifference(run="a", logger="b", pair=("speed", "speed"), delay=0.1, delay_std=3e-3, at=50.0, **DRIFT)


def test_a_drift_that_is_not_corrected_adds_to_the_error_of_the_delay() -> None:
    time = np.linspace(0.0, 100.0, 10_001)
    rms = 1e-4 * 100.0 / np.sqrt(12.0)
    assert CLOCK.run_delay_std(time) == pytest.approx(np.hypot(3e-3, rms), rel=1e-3)
    assert CLOCK.model_copy(update={"corrected": True}).run_delay_std(time) == 3e-3
    assert CLOCK.model_copy(update={"drift_std": float("inf")}).run_delay_std(time) == 3e-3
