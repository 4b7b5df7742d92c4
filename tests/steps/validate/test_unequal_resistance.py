"""A drive with a dragging brake differs from the others; a slope, a headwind and a fault of all drives do not."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant.sensors import Array
from vdyn_cli.steps.validate.drives.unequal_drives import unequal_drives
from vdyn_cli.steps.validate.drives.unequal_resistance import other_resistance

MASS, RADIUS, STEP = 1700.0, 0.32, 0.1  # kg, m, s
ROLLING, DRAG = 160.0, 0.45  # N, N/(m/s)^2
HEADINGS = (1.0, -1.0, 1.0, -1.0)
Driven = tuple[Array, dict[str, Array], Array]


def drive(seed: int, drag: float = 0.0, slope: float = 0.0, wind: float = 0.0, mass: float = MASS) -> Driven:
    """Four minutes under a torque that changes every few seconds, by Euler's method."""
    rng = np.random.default_rng([6, seed])
    time = np.arange(0.0, 240.0, STEP)
    torque = np.interp(time, np.cumsum(rng.uniform(2.0, 9.0, 80)), rng.uniform(60.0, 300.0, 80))
    v, speed = 12.0, np.empty(time.size)
    for k in range(time.size):
        speed[k] = v
        force = torque[k] / RADIUS - ROLLING - drag - DRAG * (v + wind) * abs(v + wind) - mass * 9.81 * slope
        v = max(v + STEP * force / mass, 3.0)
    channels = {"speed": speed + 0.03 * rng.standard_normal(time.size), "brake_torque": np.zeros(time.size)}
    return time, channels, torque + 0.5 * rng.standard_normal(time.size)


@pytest.mark.parametrize("odd", range(4))
def test_a_dragging_brake_in_one_of_four_drives_is_found(odd: int) -> None:
    drives = [drive(k, 200.0 if k == odd else 0.0) for k in range(4)]
    found = other_resistance(drives, HEADINGS, -ROLLING / MASS)
    assert found is not None
    assert found.drive == odd
    assert abs(found.force * MASS - 200.0) < 2.5 * found.error * MASS


@pytest.mark.parametrize(
    ("drag", "slope", "wind"), [(0.0, 0.0, 0.0), (200.0, 0.0, 0.0), (0.0, 0.008, 0.0), (0.0, 0.0, 4.0)]
)
def test_what_all_drives_share_is_left_to_the_diagnosis(drag: float, slope: float, wind: float) -> None:
    drives = [drive(10 + k, drag, h * slope, h * wind) for k, h in enumerate(HEADINGS)]
    assert other_resistance(drives, HEADINGS, -ROLLING / MASS) is None


def test_a_torque_that_one_drive_alone_loses_is_found_without_directions() -> None:
    """80 N is less than slopes of unknown direction usually add, but ten times what these drives differ by."""
    drives = [drive(40 + k, 80.0 if k == 2 else 0.0) for k in range(4)]
    found = other_resistance(drives, (0.0,) * 4, -ROLLING / MASS)
    assert found is not None
    assert found.drive == 2
    assert abs(found.force * MASS - 80.0) < 2.5 * found.error * MASS


def test_the_one_drive_in_the_other_direction_is_not_accused() -> None:
    drives = [drive(50 + k, slope=-0.005 if k == 1 else 0.005) for k in range(4)]
    assert other_resistance(drives, (0.0,) * 4, -ROLLING / MASS) is None


def test_drives_that_scatter_by_their_weather_and_road_are_not_accused() -> None:
    rng = np.random.default_rng(5)
    for _ in range(4):
        drives = [drive(60 + k, slope=0.001 * rng.standard_normal(), wind=rng.standard_normal()) for k in range(4)]
        assert other_resistance(drives, (0.0,) * 4, -ROLLING / MASS) is None


def test_three_drives_are_not_compared() -> None:
    drives = [drive(20, 200.0), drive(21), drive(22)]
    assert other_resistance(drives, HEADINGS[:3], -ROLLING / MASS) is None


def test_drives_of_the_stated_mass_are_the_usual_ones() -> None:
    """With a trailer from the third of five drives, the first two are those of the described car."""
    drives = [drive(30 + k, mass=(1.4 if k > 1 else 1.0) * MASS) for k in range(5)]
    found = unequal_drives([f"{k}.csv" for k in range(5)], drives, 1.0 / (RADIUS * MASS))
    assert list(found) == [2, 3, 4]
    assert all("larger" in f.what for f in found.values())
