"""Readings of two speeds: their integral, and the damping that noise far above the oscillations does not bias."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.shaft.shaft_fit import ShaftFit, linear_solution
from vdyn_cli.steps.shaft.shaft_readings import ShaftReadings
from vdyn_cli.steps.shaft.spec import ShaftSpec
from vdyn_cli.steps.shaft.step import STEP

NOISE = (1.0, 0.3, 0.02)


@pytest.mark.parametrize("jitter", [0.0, 0.1])
@pytest.mark.parametrize(("samples", "near"), [(5.0, 0.02), (10.0, 1e-3), (50.0, 1e-5)])
def test_the_integral_of_a_rate_is_the_twist(samples: float, near: float, jitter: float) -> None:
    time = np.arange(400) + jitter * np.random.default_rng(1).uniform(-1, 1, 400)
    w = 2 * np.pi / samples
    twist, rate = np.sin(w * time), w * np.cos(w * time)
    readings = ShaftReadings("tip_in.csv", time, twist, twist, rate, NOISE)
    missed = readings.linked(twist, rate)
    assert np.abs(missed[3:-3]).max() < near * w


def tip_ins(seed: int, damping: float) -> Log:
    """12 s at 500 Hz of a shaft of 8000 N m/rad that swings at 6 Hz, swelling every 1.5 s, read by two speeds."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 12.0, 2e-3)
    w, swell = 2 * np.pi * 6, np.pi / 1.5
    twist = 5e-3 * np.sin(w * time) * np.sin(swell * time)
    rate = 5e-3 * (w * np.cos(w * time) * np.sin(swell * time) + swell * np.sin(w * time) * np.cos(swell * time))
    torque = 8000 * twist + damping * rate + rng.normal(0, 1.5, time.size)
    wheel, motor = (40 + more + rng.normal(0, 0.05, time.size) for more in (0, rate))
    return Log("tip_in.csv", time, {"shaft_torque": torque, "motor_speed": motor, "wheel_speed": wheel})


@pytest.mark.slow
def test_noise_of_the_speeds_does_not_bias_the_damping() -> None:
    off = []
    for seed in range(3):
        runs = (ShaftReadings.of(tip_ins(seed, 12.0), 1.0).averaged(),)
        assert runs[0].time.size < 2000  # of 6000
        solution, covariance = ShaftFit(runs).solve(linear_solution(runs))
        off.append((solution.values["shaft_damping"] - 12.0) / covariance[1, 1] ** 0.5)
    assert np.abs(off).max() < 3
    assert abs(np.mean(off)) < 1.7


def test_a_damping_that_is_not_published_has_no_correlation() -> None:
    spec = ShaftSpec.model_validate({"test": "shaft", "runs": [{"log": "tip_in.csv", "side": "left"}]})
    found = STEP.estimate(spec, (tip_ins(1, -30.0),), Parameters()).parameters
    assert set(found) == {"shaft_stiffness_left"}
    assert not found.correlation


def test_a_shaft_that_does_not_move_is_refused() -> None:
    """A constant log ended as a division by zero."""
    spec = ShaftSpec.model_validate({"test": "shaft", "runs": [{"log": "tip_in.csv", "side": "left"}]})
    still = {n: np.full(6000, v) for n, v in {"shaft_torque": -19.2, "twist": 0.01}.items()}
    with pytest.raises(InputError, match="the twist is constant"):
        STEP.prepare(spec, (Log("tip_in.csv", np.arange(6000) * 2e-3, still),), Parameters())
