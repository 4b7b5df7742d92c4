"""An acceleration that a logger computes from its speed is no accelerometer."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.coasts.derived_acceleration import derived_finding


def coasts(rate: float, noise: float, kind: str) -> list[Log]:
    """Three coasts with gusts over 3 s; the acceleration is that of a ``sensor``, or computed from the noisy speed."""
    random, time = np.random.default_rng(4), np.arange(0.0, 80.0, 1.0 / rate)
    logs = []
    for _ in range(3):
        gusts = np.zeros(time.size)
        keep = np.exp(-1.0 / (3.0 * rate))
        for i, step in enumerate(random.standard_normal(time.size - 1), start=1):
            gusts[i] = keep * gusts[i - 1] + 0.03 * np.sqrt(1.0 - keep**2) * step
        true = -0.15 - 3e-4 * (30.0 - 0.3 * time) ** 2 + gusts
        speed = 30.0 + np.cumsum(true) / rate + noise * random.standard_normal(time.size)
        acceleration = np.gradient(speed, time)
        if kind == "sensor":
            acceleration = true + 0.1 + 0.03 * random.standard_normal(time.size)
        elif kind == "filtered":
            acceleration = np.convolve(acceleration, np.full(5, 0.2), mode="same")
        elif kind == "rounded":
            acceleration = np.round(acceleration / 9.81, 2) * 9.81
        logs.append(Log("coast.csv", time, {"speed": speed, "acceleration": acceleration}))
    return logs


@pytest.mark.parametrize(("rate", "noise"), [(1.0, 0.05), (10.0, 0.03), (50.0, 0.02)])
def test_a_derivative_of_the_speed_is_told_from_a_sensor(rate: float, noise: float) -> None:
    assert derived_finding(coasts(rate, noise, "sensor")) is None
    for kind in ("plain", "filtered", "rounded")[: 3 if rate > 1.0 else 1]:
        found = derived_finding(coasts(rate, noise, kind))
        assert found is not None
        assert "it is computed from the speed" in found.what


def test_logs_without_noise_show_nothing() -> None:
    time = np.arange(0.0, 80.0, 0.1)
    log = Log("coast.csv", time, {"speed": 30.0 - 0.2 * time, "acceleration": np.full(time.size, -0.2)})
    assert derived_finding([log]) is None
