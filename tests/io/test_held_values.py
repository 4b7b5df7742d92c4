"""A slower sensor's held values: its samples are found, and the values between are interpolated without delay."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from vdyn_cli.io.clocks.held_values import held_rows, with_held_interpolated
from vdyn_cli.quantities.log import Log

Array = NDArray[np.float64]
TIME = np.arange(6000) * 0.02


def speed(time: Array) -> Array:
    """A car at rest for 10 s, and then a drive, m/s."""
    return 12.0 * np.sin(np.maximum(time - 10.0, 0.0) / 20.0) ** 2


def held(every: int, phase: int = 0, seed: int = 0) -> tuple[NDArray[np.intp], Array]:
    """The rows at which the sensor was sampled, and the channel: the last reading, to 0.01 km/h."""
    own = np.arange(phase, TIME.size, every)
    noise = np.random.default_rng(seed).normal(0.0, 0.05, own.size)
    read = np.round(3.6 * speed(TIME[own]) + noise, 2) / 3.6
    return own, read[np.maximum(np.searchsorted(own, np.arange(TIME.size), "right") - 1, 0)]


@pytest.mark.parametrize(("every", "phase"), [(2, 0), (5, 3), (10, 7)])
def test_the_rows_of_the_sensor_are_found(every: int, phase: int) -> None:
    own, values = held(every, phase)
    found = held_rows(values)
    assert found is not None
    assert np.mean(np.isin(found, own)) > 0.99
    assert found.size >= 0.98 * own.size  # equal readings in a row count, too


def test_a_coarse_sensor_whose_readings_often_repeat_is_held() -> None:
    """Every fifth reading of a height in steps of 0.1 m equals the one before."""
    read = np.round(TIME[::10] * 0.05 + np.random.default_rng(3).normal(0.0, 0.13, TIME.size // 10), 1)
    assert np.mean(np.diff(read) == 0.0) > 0.2
    found = held_rows(np.repeat(read, 10))
    assert found is not None
    assert found.size == pytest.approx(TIME.size // 10, abs=3)


@pytest.mark.parametrize("every", [3.4, 4.4, 5.2])
def test_a_clock_that_is_not_the_sensors_jitters_by_a_row(every: float) -> None:
    own = np.rint(np.arange(0, TIME.size, every)).astype(int)
    values = speed(TIME[own])[np.searchsorted(own, np.arange(TIME.size), "right") - 1]
    found = held_rows(values)
    assert found is not None
    changes = np.flatnonzero(np.diff(values)) + 1
    assert np.isin(changes[:-1], found).all()


def test_joined_values_are_not_late() -> None:
    log = with_held_interpolated(Log("run.csv", TIME, {"speed": held(10)[1]}))
    moving, rate = TIME > 12.0, np.gradient(speed(TIME), TIME)
    late = [float(rate[moving] @ (speed(TIME) - v)[moving] / (rate[moving] @ rate[moving])) for v in _both(log)]
    assert late[0] == pytest.approx(0.09, abs=0.005)
    assert late[1] == pytest.approx(0.0, abs=0.005)
    assert log.samples["speed"][0].size == pytest.approx(TIME.size / 10, abs=10)


def _both(log: Log) -> tuple[Array, Array]:
    return held(10)[1], log["speed"]


def test_gaps_stay_gaps_and_other_channels_stay_as_they_are() -> None:
    values = held(5)[1]
    values[1000:1200] = np.nan
    torque = np.random.default_rng(1).normal(0.0, 20.0, TIME.size)
    log = with_held_interpolated(Log("run.csv", TIME, {"speed": values, "drive_torque": torque}))
    assert np.array_equal(np.isnan(log["speed"]), np.isnan(values))
    assert np.array_equal(log["drive_torque"], torque)
    assert list(log.samples) == ["speed"]
    assert log.held == {"speed": pytest.approx(TIME[1] - TIME[0])}


@pytest.mark.parametrize(
    "values",
    [
        np.random.default_rng(2).normal(0.0, 1.0, 3000),
        np.round(np.linspace(0.0, 30.0, 3000), 1),  # a steady slope of a coarse channel
        np.repeat([0.0, 1.0, 2.0, 3.0], 750),  # a gear
        np.zeros(3000),
    ],
)
def test_what_is_not_held_stays(values: Array) -> None:
    assert held_rows(values) is None
