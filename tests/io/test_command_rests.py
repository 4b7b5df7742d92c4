"""A drive torque that a logger loses or freezes is found by the car's motion; a truly constant torque is not."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from vdyn_cli.io.quality.command_rests import DriveTie, contradicted_rests
from vdyn_cli.io.quality.log_flags import flags
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quality_flags import Flag

Array = NDArray[np.float64]
N = 6000
T = 0.1 * np.arange(N)


def car(seed: int = 1, brakes: bool = False) -> dict[str, Array]:
    """An electric car's torque in steps of 0.5 N m, constant at zero now and then, and the resulting force."""
    rng = np.random.default_rng(seed)
    wanted = 40.0 + 35.0 * np.sin(0.11 * T) + 25.0 * np.sin(0.53 * T + seed) + 8.0 * np.sin(2.1 * T)
    wanted += np.convolve(rng.normal(0.0, 6.0, N), np.ones(5) / 5.0, "same")
    coasting = (T % 60.0) > 56.0
    fade = np.clip(np.minimum(np.abs(T % 60.0 - 56.0), np.abs(T % 60.0 - 60.0)), 0.0, 1.0)
    torque = np.where(coasting, 0.0, np.round(2.0 * wanted * fade) / 2.0)
    held = np.repeat(torque[::2], 2)  # a coarse command, interpolated linearly
    torque = np.round(np.where(np.arange(N) % 2 == 0, held, 0.5 * (held + np.roll(held, -1))), 2)
    torque[coasting] = 0.0
    speed = 15.0 + 4.0 * np.sin(0.05 * T)
    force = 0.017 * torque - 0.1 - 2e-4 * speed**2 + rng.normal(0.0, 0.05, N)
    if brakes:
        force[coasting] -= 1.5
    return {
        "speed": np.round(speed + rng.normal(0.0, 0.02, N), 3),
        "drive_torque": torque,
        "acceleration": np.round(force, 2),
    }


def states(channels: dict[str, Array]) -> NDArray[np.uint8]:
    return flags(Log("run.csv", T, channels)).states["drive_torque"]


@pytest.mark.parametrize("brakes", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_coasting_at_zero_torque_is_no_fault_with_brakes_or_without(seed: int, brakes: bool) -> None:
    assert set(states(car(seed, brakes)).tolist()) == {Flag.GOOD}


@pytest.mark.parametrize("length", [10, 30, 600])
@pytest.mark.parametrize("lost", [True, False])
def test_a_torque_that_is_lost_or_frozen_while_the_car_goes_on_is_found(length: int, lost: bool) -> None:
    channels = car()
    torque = channels["drive_torque"][1200:1700]
    first = 1200 + int(np.argmin(torque[10:] - torque[:-10]))  # it changes most within a second from here
    channels["drive_torque"][first : first + length] = 0.0 if lost else channels["drive_torque"][first]
    found = states(channels)
    assert (found[first + 1 : first + length] == Flag.FAILED).all()
    assert (found[: first - 1] == Flag.GOOD).all()


def test_a_torque_that_the_car_follows_to_zero_and_back_is_no_fault() -> None:
    channels = car()
    missing = channels["drive_torque"][1500:1530].copy()
    channels["drive_torque"][1500:1530] = 0.0
    channels["acceleration"][1500:1530] -= np.round(0.017 * missing, 2)
    assert set(states(channels).tolist()) == {Flag.GOOD}


def test_without_an_accelerometer_a_torque_may_step_to_zero() -> None:
    channels = car()
    channels["drive_torque"][1500:1530] = 0.0
    del channels["acceleration"]
    assert set(states(channels).tolist()) == {Flag.GOOD}


def test_a_slow_line_whose_rounding_rests_is_found() -> None:
    channels = car()
    torque = channels["drive_torque"]
    noise = np.random.default_rng(1).normal(0.0, 0.2, N)
    channels["drive_torque"] = torque = np.where(torque == 0.0, 0.0, np.round(torque + noise, 2))
    torque[2000:2600] = np.round(np.linspace(torque[1999], torque[1999] + 4.0, 602)[1:-1], 2)
    found = states(channels)
    assert np.mean(found[2000:2600] == Flag.FAILED) > 0.95


@pytest.mark.parametrize(("late", "frozen"), [(0, False), (11, False), (0, True)])
def test_a_late_torque_that_falls_between_two_gears_was_not_frozen(late: int, frozen: bool) -> None:
    """At 50 Hz a torque of 545 N m decays within 0.1 s; it is 0.22 s late, or the car does not follow it."""
    k = np.arange(400)
    torque = 545.0 * np.exp(-np.maximum(k - 200, 0) / 3.0)
    force = 0.002 * (np.full(k.size, 545.0) if frozen else np.r_[torque[late:], np.zeros(late)])
    tie = DriveTie(force - 0.002 * torque, 0.002, 0.05, 0.2, 50)
    assert bool(list(contradicted_rests(torque, [(150, 201)], tie))) == frozen
