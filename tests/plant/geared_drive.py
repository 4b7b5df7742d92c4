"""Drives of a combustion car with three gears: torque behind the gearbox times its ratio, speed, and engine speed.

In a gear, the engine turns with the wheels and takes its share of the torque; while a shift takes 0.4 s, and below its
idling speed, a clutch disconnects it::

    m v' + j/r^2 v' + J g^2/r^2 v' = e T/r - c m g - rho A (v + w)|v + w|/2

with g the turns of the engine per turn of a wheel. Integrated by Euler's method.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import exp, pi, sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
STEP = 0.01  # s
IDLE = 850.0 * pi / 30.0  # rad/s, of the engine


@dataclass(frozen=True)
class Car:
    """SI; ``gears``: ratios of the gearbox, ``final``: of the final drive, before which the torque is stated."""

    mass: float = 1240.0
    wheels: float = 3.1
    engine: float = 0.14
    radius: float = 0.296
    final: float = 4.1
    gears: tuple[float, ...] = (3.5, 1.8, 1.1)
    efficiency: float = 0.95
    rolling: float = 0.0102
    drag_area: float = 0.64
    density: float = 1.2
    most: float = 150.0  # N m, of the engine


def drives(car: Car, seed: int, count: int = 4, seconds: float = 70.0) -> list[Mapping[str, Array]]:
    """time, torque (N m, at the final drive's input), speed (m/s) and engine speed (rad/s) of each drive, (n,) each."""
    rng = np.random.default_rng([seed, 0x6E])
    return [_drive(car, rng, int(seconds / STEP)) for _ in range(count)]


def _drive(car: Car, rng: np.random.Generator, n: int) -> Mapping[str, Array]:
    at = np.cumsum(np.r_[1.0, rng.uniform(4.0, 10.0, 60)])
    targets = np.r_[rng.uniform(4.0, 8.0), rng.uniform(2.5, 17.0, 60)]  # m/s, that the driver wants
    eager = rng.uniform(0.25, 1.0, 61)
    keep, gust, mean = exp(-STEP / 6.0), 0.0, rng.normal(0.0, 0.2)
    v, torque, gear, shift = 0.0, 0.0, 0, 0.0
    turned = IDLE
    found = np.empty((4, n))
    for k in range(n):
        time, total = k * STEP, car.final * car.gears[gear]
        turning = v / car.radius * total
        k_at = int(np.searchsorted(at, time))
        load = car.rolling * car.mass * 9.81 + 0.5 * car.density * car.drag_area * v**2
        push = load + 0.8 * car.mass * (targets[k_at] - v)
        limits = (-0.12 * car.most if v > 2.0 else 0.0), eager[k_at] * car.most
        wanted = min(max(push * car.radius / total, limits[0]), limits[1])
        shift = max(shift - STEP, 0.0)
        if not shift and turning > 2900 * pi / 30 and gear < len(car.gears) - 1:
            gear, shift = gear + 1, 0.4
        elif not shift and turning < 1200 * pi / 30 and gear > 0:
            gear, shift = gear - 1, 0.4
        torque += ((0.0 if shift else wanted) - torque) * STEP / 0.1
        total = car.final * car.gears[gear]
        turning = v / car.radius * total
        closed = not shift and turning > IDLE
        turned += (max(turning, IDLE) - turned) * (1.0 if closed else STEP / 0.1)
        at_axle = torque * car.gears[gear]
        found[:, k] = time, at_axle, v, turned
        gust = keep * gust + 0.4 * sqrt(1.0 - keep**2) * rng.standard_normal()
        driven = at_axle * car.final / car.radius * (car.efficiency if torque > 0 else 1.0 / car.efficiency)
        air = v + mean + gust
        force = driven - car.rolling * car.mass * 9.81 - 0.5 * car.density * car.drag_area * air * abs(air)
        inertia = car.mass + (car.wheels + (car.engine * total**2 if closed else 0.0)) / car.radius**2
        v = max(v + STEP * force / inertia, 0.0)
    return dict(zip(("time", "torque", "speed", "engine"), found, strict=True))
