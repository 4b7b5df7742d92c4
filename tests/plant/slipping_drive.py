"""Drives of a car whose driven wheels slip, on an uneven road in gusts: motor torque and speed as loggers give them.

With F the force of the driven tires and u = r w their speed::

    j u' = P - F              F = s z m g (u - v)/v          m v' = F - c m g - rho A (v + w)|v + w|/2 - m g slope

P = e T i/r while the motor drives, and T i/(e r) while it brakes, since the gears take their share of the power that
enters; j the mass that turns with the driven wheels. All drives are integrated at once by Euler's method, implicit
in u.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
G, STEP = 9.81, 0.001  # m/s^2, s


@dataclass(frozen=True)
class Car:
    """SI; ``stiffness``: of a tire over its load, ``driven``: share of the weight, ``ratio``: motor turns a wheel's.

    ``recuperated``: drive force / weight with which the motor brakes at times. ``cooled``: share by which the rolling
    resistance is larger at the start of each drive; it decays in 100 s.
    """

    mass: float = 1450.0
    turning: float = 55.0
    radius: float = 0.305
    rolling: float = 0.0095
    drag_area: float = 0.62
    density: float = 1.19
    stiffness: float = 22.0
    driven: float = 0.55
    ratio: float = 9.0
    efficiency: float = 1.0
    recuperated: float = 0.0
    cooled: float = 0.0


def drives(
    car: Car, seed: int, count: int = 6, seconds: float = 60.0, undulation: float = 5e-4, cold: float = 0.0
) -> Mapping[str, Array]:
    """time (n,) s, torque (count, n) N m of the motor, speed and wheel speed u (count, n) m/s, at 1 kHz.

    ``felt`` (count, n) m/s^2 is the specific force, v' + g slope. Of drives there and back.

    Parameters
    ----------
    undulation : rms slope of the road, which each drive meets at another place.
    cold : share by which the rolling resistance is larger at first; it decays in 600 s while the drives follow one
        another without a pause.
    """
    rng = np.random.default_rng(seed)
    n = round(seconds / STEP)
    time = np.arange(n) * STEP
    torque = _torque(car, rng, count, n)
    pushed = torque * np.where(torque < 0, 1.0 / car.efficiency, car.efficiency) * car.ratio / car.radius
    gust = _colored(rng, count, n, 0.5, 8.0) + rng.normal(0.0, 0.2, (count, 1))
    push, wind = (np.ascontiguousarray(rows.T) for rows in (STEP / car.turning * pushed, gust))
    slopes = [_road(rng, undulation) for _ in range(count)]
    v = rng.uniform(8.0, 16.0, count)
    u, x = v.copy(), np.zeros(count)
    speed, wheel, rates, hills = (np.empty((n, count)) for _ in range(4))
    grip0, drag = car.stiffness * car.driven * G, 0.5 * car.density * car.drag_area / car.mass
    turned, climbing = STEP * car.mass / car.turning, np.zeros(count)
    rolling = G * car.rolling * (1.0 + cold * np.exp(-(time[:, None] + seconds * np.arange(count)) / 600.0))
    rolling += G * car.rolling * car.cooled * np.exp(-time[:, None] / 100.0)
    for k in range(n):
        speed[k], wheel[k] = v, u
        if k % 50 == 0:
            climbing = G * np.array([np.interp(at, *road) for at, road in zip(x, slopes, strict=True)])
        grip = grip0 / np.maximum(v, 1.0)
        pull = turned * grip
        u = (u + push[k] + pull * v) / (1.0 + pull)
        air = v + wind[k]
        rate = grip * (u - v) - rolling[k] - climbing - drag * air * np.abs(air)
        rates[k], hills[k] = rate, climbing
        v = v + STEP * rate
        x = x + STEP * v
    speed, wheel, felt = speed.T.copy(), wheel.T.copy(), (rates + hills).T.copy()
    return {"time": time, "torque": torque, "speed": speed, "wheel": wheel, "felt": felt}


def _torque(car: Car, rng: np.random.Generator, count: int, n: int) -> Array:
    """(count, n) N m: levels that a driver holds for some seconds, each entered within a third of one."""
    found = np.empty((count, n))
    for row in found:
        edges = np.cumsum(rng.uniform(2.0, 7.0, 40)) / STEP
        least = -car.recuperated  # none: no braking
        levels = rng.choice([least, 0.02, 0.05, 0.09, 0.13], 41) * car.mass * G * car.radius / car.ratio
        row[:] = levels[np.searchsorted(edges, np.arange(n))]
    lag = round(0.3 / STEP)
    padded = np.hstack([np.repeat(found[:, :1], lag, axis=1), found])
    total = np.cumsum(padded, axis=1)
    return np.asarray((total[:, lag:] - total[:, :-lag]) / lag)


def _colored(rng: np.random.Generator, count: int, n: int, sd: float, lasting: float) -> Array:
    coarse = round(n * STEP / 0.1) + 2
    keep = np.exp(-0.1 / lasting)
    found = np.empty((count, coarse))
    found[:, 0] = rng.normal(0.0, sd, count)
    for k in range(1, coarse):
        found[:, k] = keep * found[:, k - 1] + rng.normal(0.0, sd * np.sqrt(1.0 - keep**2), count)
    at = np.arange(n) * STEP / 0.1
    return np.array([np.interp(at, np.arange(coarse), row) for row in found])


def _road(rng: np.random.Generator, rms: float) -> tuple[Array, Array]:
    """Places, m, and slopes of a road with waves of 60 to 800 m."""
    place = np.arange(0.0, 3000.0, 2.0)
    waves = [np.sin(2 * np.pi * place / one + rng.uniform(0, 2 * np.pi)) for one in np.geomspace(60.0, 800.0, 12)]
    slope = np.sum(waves, axis=0)
    return place, rms * slope / max(float(slope.std()), 1e-12)
