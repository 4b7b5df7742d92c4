"""The accelerometer's zero from the energy of a drive."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.road.accelerometer_zero import zero_of

GRAVITY = 9.80665
TRUTH = 0.06


def drive(climb: float, *, elevation: bool = True) -> Log:
    """Ten minutes up and down a road that ends ``climb`` m higher."""
    time = np.arange(0.0, 600.0, 0.1)
    speed = 15.0 + 8.0 * np.sin(time / 17.0)
    position = np.concatenate([[0.0], np.cumsum(0.05 * (speed[1:] + speed[:-1]))])
    height = 20.0 * np.sin(position / 700.0)
    height += position / position[-1] * (climb - height[-1])
    slope = np.gradient(height, position)
    force = 8.0 / 17.0 * np.cos(time / 17.0) + GRAVITY * np.sin(np.arctan(slope)) + TRUTH
    channels = {"speed": speed, "acceleration": force}
    return Log("drive.csv", time, channels | ({"elevation": 500.0 + height} if elevation else {}))


def test_the_zero_is_found_whatever_the_road_did_in_between() -> None:
    zero = zero_of(drive(40.0), 5.0, 0.003)
    assert zero.value == pytest.approx(TRUTH, abs=2e-3)
    assert zero.by_elevation
    assert zero.std == pytest.approx(GRAVITY * np.sqrt(2) * 5.0 / 9000.0, rel=0.1)


def test_without_elevation_the_road_is_taken_to_lead_nowhere() -> None:
    zero = zero_of(drive(40.0, elevation=False), 5.0, 0.003)
    assert not zero.by_elevation
    assert zero.std == pytest.approx(GRAVITY * 0.003)
    assert abs(zero.value - TRUTH) < 3 * zero.std


def test_an_elevation_that_stands_still_is_none() -> None:
    log = drive(0.0)
    zero = zero_of(log.with_channels(elevation=np.full(log.time.size, 582.0)), 5.0, 0.003)
    assert not zero.by_elevation


def test_holes_in_the_log_are_left_out() -> None:
    log = drive(10.0)
    force = log["acceleration"].copy()
    force[2000:2400] = np.nan
    assert zero_of(log.with_channels(acceleration=force), 5.0, 0.003).value == pytest.approx(TRUTH, abs=0.02)


def test_a_drive_too_short_tells_next_to_nothing() -> None:
    assert zero_of(drive(0.0).between(0.0, 20.0), 5.0, 0.003).std > 0.1
