"""What sensors and loggers do to a true signal: pure functions on arrays, and presets after the paper's equipment.

Order of a reading: the true signal is looked up at the (jittered, delayed) sample times, passes gain, offset and tilt,
gets noise, is clipped to its range and rounded to its step.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from tests.plant.vehicle import GRAVITY

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sensor:
    """One channel's habits in SI units; ``zero`` is the standard deviation of the zero drawn afresh for each run."""

    noise: float = 0.0
    step: float = 0.0
    zero: float = 0.0
    gain: float = 0.0  # error: reads (1 + gain) times the truth
    offset: float = 0.0
    latency: float = 0.0  # s
    limit: float = float("inf")

    def but(self, **changed: float) -> Sensor:
        return replace(self, **changed)


@dataclass(frozen=True)
class Record(Mapping[str, Array]):
    """One log as a test bench would write it: column header (with unit) to values, in order; decimals as written."""

    columns: dict[str, Array]
    decimals: dict[str, int] = field(default_factory=dict)

    def __getitem__(self, header: str) -> Array:
        return self.columns[header]

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.columns)


# Wheel force sensor at the hub: 0.1 % of +-24 kN and of +-4 kN m; GPS, laser ground sensor, wheel position sensor, IMU.
GPS_SPEED = Sensor(noise=0.03, step=0.01 / 3.6, latency=0.05)
GPS_POSITION = Sensor(noise=0.3, step=0.01)
GPS_ACCELERATION = Sensor(noise=0.05, step=0.001)
GROUND_SPEED = Sensor(noise=0.02, step=0.01 / 3.6)
WHEEL_FORCE = Sensor(noise=12.0, step=1.0, zero=10.0, limit=24_000.0)
WHEEL_TORQUE = Sensor(noise=2.0, step=0.1, zero=1.0, limit=4_000.0)
WHEEL_SPEED = Sensor(noise=0.01, step=0.001)
SHAFT_TORQUE = Sensor(noise=1.5, step=0.1, zero=0.5, limit=4_000.0)
ACCELEROMETER = Sensor(noise=0.03, step=0.001, zero=0.003, limit=20.0)
GYRO = Sensor(noise=np.radians(0.05), step=np.radians(0.001), zero=np.radians(0.05), limit=np.radians(100.0))


def regular(duration: float, rate: float) -> Array:
    """Sample times 0, 1/rate, ... up to ``duration`` (s)."""
    return np.arange(round(duration * rate) + 1) / rate


def jitter(times: Array, share: float, rng: np.random.Generator) -> Array:
    """Each sample time moved by up to ``share`` (< 0.5) of the spacing, uniformly; the log knows the moved times."""
    spacing = float(np.median(np.diff(times)))
    moved = times + spacing * share * rng.uniform(-1.0, 1.0, times.size)
    return moved - min(0.0, float(moved[0]))


def at(times: Array, clock: Array, signal: Array, latency: float = 0.0) -> Array:
    """The signal known on the fine ``clock``, seen ``latency`` s late at ``times`` (linear between fine points)."""
    return np.interp(times - latency, clock, signal)


def tilt(specific_force: Array, angle: float) -> Array:
    """A forward accelerometer whose nose points up by ``angle`` rad also feels g sin(angle)."""
    return specific_force * np.cos(angle) + GRAVITY * np.sin(angle)


def white(signal: Array, sd: float, rng: np.random.Generator) -> Array:
    return signal + sd * rng.standard_normal(np.shape(signal))


def quantize(signal: Array, step: float) -> Array:
    return np.round(signal / step) * step if step > 0 else signal


def crosstalk(channels: Array, matrix: Array) -> Array:
    """Readings (channel, sample) that hold shares of each other: identity + ``matrix``."""
    return channels + matrix @ channels


def read(sensor: Sensor, true: Array, rng: np.random.Generator) -> Array:
    """The readings of a true signal that is already at the sensor's sample times (latency is ``at``'s part)."""
    zero = sensor.offset + sensor.zero * rng.standard_normal()
    reading = white((1.0 + sensor.gain) * true + zero, sensor.noise, rng)
    return quantize(np.clip(reading, -sensor.limit, sensor.limit), sensor.step)
