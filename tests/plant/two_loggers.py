"""One drive recorded by two loggers whose clocks differ by a delay and a drift; truth of its own, no vdyn code.

The car follows a random demand of acceleration on a road of slow slopes. Recorded are, by one logger, wheel speed with
tire slip, speed and position, by the other a satellite speed of 10 Hz and an accelerometer that feels slope, pitch and
a bias.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_STEP = 0.002  # s, of the true motion
_RADIUS = 0.31  # m


@dataclass(frozen=True)
class TwoLoggers:
    """Both recordings, each as (time, values) by channel, and the truth.

    What the first logger stamps t, the second stamps t + delay + drift t.
    """

    first: dict[str, tuple[Array, Array]]
    second: dict[str, tuple[Array, Array]]
    delay: float
    drift: float


def two_loggers(rng: np.random.Generator, duration: float = 600.0) -> TwoLoggers:
    """A drive of some minutes, with a delay of 20 to 150 ms and a drift of 20 to 200 ppm, either sign."""
    t = np.arange(-2.0, duration + 2.0, _STEP)
    speed, pull = _motion(t, rng)
    place = (np.cumsum(speed) - 0.5 * speed) * _STEP
    slope = _wander(t, 25.0, 0.008, rng)
    slip = pull * rng.uniform(0.003, 0.015)  # of a driven axle, 1 per m/s^2: mass over slip stiffness
    pitch = -np.radians(rng.uniform(0.2, 0.6)) * pull
    felt = pull * rng.uniform(0.99, 1.01) + 9.81 * (slope + pitch) + rng.normal(0.0, 0.2)
    delay = rng.uniform(0.02, 0.15) * rng.choice([-1.0, 1.0])
    drift = rng.uniform(20e-6, 200e-6) * rng.choice([-1.0, 1.0])
    bus, sky, box = (np.arange(rng.uniform(0.0, 1.0 / r), duration, 1.0 / r) for r in (50.0, 10.0, 100.0))

    def stamped(time: Array) -> Array:
        return np.asarray(time + delay + drift * time)

    def sampled(time: Array, true: Array, noise: float, grain: float = 0.0) -> Array:
        values = np.interp(time, t, true) + rng.normal(0.0, noise, time.size)
        return np.asarray(np.round(values / grain) * grain if grain else values)

    first = {
        "speed": (bus, sampled(bus, speed * rng.uniform(0.985, 1.015), 0.03, 0.01 / 3.6)),
        "wheel_speed": (bus, sampled(bus, speed * (1.0 + slip) / _RADIUS, 0.08, 0.02)),
        "position": (bus, sampled(bus, place, 0.05)),
    }
    second = {
        "speed": (stamped(sky), sampled(sky, speed, 0.04)),
        "acceleration": (stamped(box), sampled(box, felt, 0.25)),
    }
    return TwoLoggers(first, second, float(delay), float(drift))


def _motion(t: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Speed (m/s) and acceleration (m/s^2) of a drive between 5 and 35 m/s."""
    demand = _wander(t, 4.0, 1.2, rng)
    kernel = np.hanning(int(0.6 / _STEP))
    demand = np.convolve(demand, kernel / kernel.sum(), "same")
    speed = np.empty(t.size)
    pull = np.empty(t.size)
    v = rng.uniform(12.0, 22.0)
    for i, wanted in enumerate(demand):
        pull[i] = wanted - 0.03 * (v - 18.0)
        v = max(v + pull[i] * _STEP, 2.0)
        speed[i] = v
    return speed, np.gradient(speed, _STEP)


def _wander(t: Array, time: float, size: float, rng: np.random.Generator) -> Array:
    """A slow random function of the given standard deviation, with knots so many seconds apart."""
    knots = np.arange(t[0] - time, t[-1] + time, time)
    return np.asarray(np.interp(t, knots, rng.normal(0.0, size, knots.size)))
