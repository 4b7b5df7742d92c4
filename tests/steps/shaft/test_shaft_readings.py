"""The twist from logged rates keeps its size where an oscillation has few samples."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.steps.shaft.shaft_readings import ShaftReadings

NOISE = (1.0, 0.3, 0.02)


@pytest.mark.parametrize("jitter", [0.0, 0.1])
@pytest.mark.parametrize(("samples", "near"), [(5.0, 0.02), (10.0, 1e-3), (50.0, 1e-5)])
def test_the_integral_of_a_rate_is_the_twist(samples: float, near: float, jitter: float) -> None:
    time = np.arange(400) + jitter * np.random.default_rng(1).uniform(-1, 1, 400)
    w = 2 * np.pi / samples
    twist, rate = np.sin(w * time), w * np.cos(w * time)
    readings = ShaftReadings("tip_in.csv", time, twist, twist, rate, NOISE)
    missed = readings.linked(twist, rate) + readings.bend
    assert np.abs(missed[3:-3]).max() < near * w
