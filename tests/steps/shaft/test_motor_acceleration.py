"""The acceleration of a half-shaft's inner end, and the covariance of its noise."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.steps.shaft.motor_acceleration import acceleration, autocovariance, by_speed

TIME = np.arange(0.0, 2.0, 0.004)


@pytest.mark.parametrize("rate", [100.0, 250.0, 1000.0])
def test_an_oscillation_of_10_hz_is_kept(rate: float) -> None:
    time, w = np.arange(0.0, 1.0, 1.0 / rate), 2 * np.pi * 10.0
    found = acceleration(time, np.sin(w * time))
    assert found[5:-5] == pytest.approx((w * np.cos(w * time))[5:-5], abs=0.05 * w)


def test_a_gap_does_not_change_the_accelerations_beside_it() -> None:
    time = np.delete(TIME, np.arange(200, 240))
    assert acceleration(time, time**2) == pytest.approx(2 * time, abs=5e-3)


def test_its_noise_has_this_covariance() -> None:
    rows = np.random.default_rng(2).normal(0.0, 0.03, (300, TIME.size))
    seen = np.array([acceleration(TIME, row)[10:-10] for row in rows])
    expected = autocovariance(TIME, 0.03)
    for apart in range(expected.size):
        products = seen[:, : seen.shape[1] - apart] * seen[:, apart:]
        assert float(products.mean()) == pytest.approx(expected[apart], abs=0.02 * expected[0])


def test_pulls_of_the_accelerations_are_those_of_the_speeds() -> None:
    random = np.random.default_rng(3)
    speed, change = random.normal(size=(2, TIME.size))
    pulls = np.where(np.abs(TIME - 1.0) < 0.5, random.normal(size=TIME.size), 0.0)
    change[:20] = change[-20:] = 0.0
    moved = acceleration(TIME, speed + change) - acceleration(TIME, speed)
    assert pulls @ moved == pytest.approx(by_speed(TIME, pulls) @ change)
