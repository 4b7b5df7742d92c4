"""A drive with another load, by the acceleration per drive torque of each drive."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant.sensors import Array
from vdyn_cli.steps.validate.drives.unequal_drives import load_change, unequal_drives

MASS, RADIUS, STEP = 1700.0, 0.32, 0.1  # kg, m, s
HILLS = 0.002  # rms grade over 250 m
Driven = tuple[Array, dict[str, Array], Array]


def drive(seed: int, mass: float = MASS, scale: float = 1.0) -> Driven:
    """Some minutes on an undulating road under a torque that changes every few seconds, read 0.1 s late."""
    rng = np.random.default_rng([5, seed])
    time = np.arange(0.0, 400.0, STEP)
    at = np.cumsum(rng.uniform(2.0, 9.0, 80))
    torque = np.interp(time, at, rng.uniform(60.0, 420.0, 80))
    x, v, speed = 0.0, 10.0, np.empty(time.size)
    place, phase = rng.uniform(40.0, 120.0, 8), rng.uniform(0.0, 2 * np.pi, 8)
    for k in range(time.size):
        speed[k] = v
        hill = HILLS * np.sqrt(2.0 / 8.0) * np.sum(np.sin(x / place + phase))
        v = max(v + STEP * ((torque[k] / RADIUS - 160.0 - 0.9 * v**2) / mass - 9.81 * hill), 0.0)
        x += STEP * v
    late = np.interp(time - 0.1, time, torque)
    channels = {"speed": speed + 0.03 * rng.standard_normal(time.size), "brake_torque": np.zeros(time.size)}
    return time, channels, scale * late + 0.5 * rng.standard_normal(time.size)


@pytest.mark.parametrize("seed", range(8))
def test_equal_drives_are_no_finding(seed: int) -> None:
    drives = [drive(10 * seed + k) for k in range(4)]
    assert not list(unequal_drives([f"{k}.csv" for k in range(4)], drives))


@pytest.mark.parametrize(("mass", "scale", "share"), [(1.15, 1.0, 15.0), (0.85, 1.0, -15.0), (1.0, 1.356, 35.6)])
def test_a_load_or_another_unit_in_two_of_six_drives_is_found(mass: float, scale: float, share: float) -> None:
    drives = [drive(k) for k in range(4)] + [drive(k, mass * MASS, scale) for k in (4, 5)]
    found = list(unequal_drives([f"{k}.csv" for k in range(6)], drives).values())
    assert [f.where for f in found] == ["4.csv", "5.csv"]
    for finding in found:
        words = finding.what.split()
        value, error = float(words[6]), float(words[8])
        assert abs(value - abs(share)) <= 1.5 * error + 1.0
        assert ("larger" if share > 0 else "smaller") in finding.what


@pytest.mark.parametrize("odd", [0, 1])
def test_of_two_drives_the_stated_car_shows_which_has_the_load(odd: int) -> None:
    masses = [1.2 * MASS if k == odd else MASS for k in range(2)]
    drives = [drive(k, mass) for k, mass in enumerate(masses)]
    assert list(unequal_drives(["0.csv", "1.csv"], drives, 1.0 / (RADIUS * MASS))) == [odd]
    assert not unequal_drives(["0.csv", "1.csv"], drives, 1.0 / (RADIUS * 2.0 * MASS))


def test_two_drives_or_a_coarse_log_are_not_compared() -> None:
    time, channels, torque = drive(1)
    coarse = time[::10], {n: v[::10] for n, v in channels.items()}, torque[::10]
    assert not list(unequal_drives(["a", "b"], [drive(0), drive(1, 1.3 * MASS)]))
    assert not list(unequal_drives(["a", "b", "c"], [coarse, coarse, drive(2, 1.3 * MASS)]))


def test_a_load_that_stays_on_board_from_one_drive_on_is_a_change_with_its_share() -> None:
    change = load_change([drive(k, 1.15 * MASS if k >= 2 else MASS) for k in range(6)])
    assert change is not None
    assert change.first == 2
    assert abs(change.ratio - 1.15) < 0.04
