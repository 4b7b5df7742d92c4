"""The zero of an acceleration that was made of a speed."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.cg.gps_zero import gps_zero

TIME = np.arange(0.0, 20.0, 0.01)


def run(seed: int, zero: float, channels: tuple[str, ...] = ("speed", "acceleration")) -> Log:
    """A car that speeds up and brakes, and is a little faster in the end."""
    rng = np.random.default_rng(seed)
    speed = 12.0 - 10.0 * np.cos(2 * np.pi * TIME / 20.0) + 0.05 * TIME
    rate = np.gradient(speed, TIME)
    values = {
        "speed": speed + rng.normal(0.0, 0.03, TIME.size),
        "acceleration": rate + zero + rng.normal(0.0, 0.1, TIME.size),
    }
    return Log(f"run_{seed}.csv", TIME, {n: values[n] for n in channels})


@pytest.mark.parametrize("zero", [0.2, -0.05])
def test_a_zero_that_the_speed_contradicts_is_told(zero: float) -> None:
    (finding,) = gps_zero([run(k, zero) for k in range(3)])
    assert finding.doubt
    assert finding.where == "3 runs"
    assert float(finding.what.split()[2]) == pytest.approx(zero, abs=0.01)


def test_an_acceleration_that_is_the_speeds_own_rate_is_none() -> None:
    for seed in range(20):
        assert not gps_zero([run(10 * seed + k, 0.0) for k in range(3)])
        assert not gps_zero([run(10 * seed, 0.0)])


def test_without_a_speed_nothing_is_said() -> None:
    assert not gps_zero([run(1, 0.5, ("acceleration",))])
