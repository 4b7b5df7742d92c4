"""Friction brakes that no channel shows, in drives of a car with recuperation."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant.sensors import Array
from vdyn_cli.steps.validate.unlogged_braking import UnloggedBraking, unlogged_braking

MASS, RADIUS, STEP = 1700.0, 0.32, 0.1  # kg, m, s
MOST = -500.0  # N m at the wheels: what recuperation can do


Driven = tuple[Array, dict[str, Array], Array, Array]


def drive(seed: int, blended: bool, lost: float = 0.0, wind: float = 0.0) -> Driven:
    """A drive of ten accelerations and stops: time, channels, torque at the wheels, and the brake's true torque."""
    rng = np.random.default_rng(seed)
    top, rate = rng.uniform(10.0, 25.0, 10), rng.uniform(1.0, 1.8, 10)
    legs = [(0.0, 3.0)]
    for v, a in zip(top, rate, strict=True):
        legs += [(v, v / 1.2), (v, 10.0), (0.0, v / a), (0.0, 3.0)]
    at = np.cumsum([t for _, t in legs])
    time = np.arange(0.0, at[-1], STEP)
    speed = np.interp(time, at, [v for v, _ in legs])
    speed = np.convolve(np.pad(speed, 5, mode="edge"), np.ones(11) / 11, "valid")
    load = 130.0 + 0.5 * 1.2 * 0.6 * (speed + wind) ** 2
    wanted = (MASS * np.gradient(speed, time) + load * (speed > 0.1)) * RADIUS
    wanted = wanted * np.where(wanted > 0, 1 + lost, 1 - lost)
    torque = np.maximum(wanted, MOST)
    brake = torque - wanted if blended else np.zeros(time.size)
    if not blended:
        torque = wanted
    noisy = speed + 0.02 * rng.standard_normal(time.size)
    return time, {"speed": noisy, "brake_torque": np.zeros(time.size)}, torque + rng.standard_normal(time.size), brake


def found(*drives: Driven) -> tuple[UnloggedBraking, ...]:
    return unlogged_braking([one[:3] for one in drives])


def test_blended_braking_without_a_channel_is_found_and_named() -> None:
    drives = [drive(seed, blended=True) for seed in range(3)]
    for one, (time, channels, _, brake) in zip(found(*drives), drives, strict=True):
        strong = (brake > 0.2 * MASS * RADIUS) & (channels["speed"] > 2.5)
        assert strong.mean() > 0.05
        assert one.braked[strong].mean() > 0.97
        assert one.braked[(brake == 0.0) & (channels["speed"] > 5.0)].mean() < 0.1
        assert one.excess == pytest.approx(brake.max() / MASS / RADIUS, rel=0.15)
        (finding,) = one.finding("drive.csv")
        assert "brakes that are not logged, left out" in finding.what
        assert time[0] <= one.spans[0][0] < one.spans[-1][1] <= time[-1]


@pytest.mark.parametrize(("lost", "wind"), [(0.0, 0.0), (0.1, 0.0), (0.0, 5.0)])
def test_recuperation_losses_and_wind_are_no_brakes(lost: float, wind: float) -> None:
    assert not any(one.spans for one in found(*(drive(seed, False, lost, wind) for seed in range(3))))


def test_brakes_that_a_channel_shows_are_not_named_again() -> None:
    time, channels, torque, brake = drive(1, blended=True)
    logged = {**channels, "brake_torque": brake}
    assert not unlogged_braking([(time, logged, torque)])[0].spans
