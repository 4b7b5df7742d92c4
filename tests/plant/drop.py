"""Drops: a quarter or half car is held above its rest and let go; the heights of body and wheels are logged.

    Ms z'' = -S1 - S2,   Is p'' = -a1 S1 - a2 S2,   mi y_i'' = S_i + max(-W_i, -Kt y_i),
    S_i = K_i x_i + C_i x_i' + F b_i / b0,   x_i = z + a_i p - y_i

W_i is the load at rest. Dry friction F is a slider behind a stiff spring: its bend b_i follows the stroke x_i between
-b0 and b0, and stays there while the strut slides on. Fourth-order Runge-Kutta steps. A quarter car has one axle and no
pitch.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tests.plant.information import Array, Information, slopes, total
from tests.plant.sensors import Record, Sensor, jitter, quantize, regular, white
from tests.plant.vehicle import GRAVITY

EFFECTS = {"suspension_friction": "N of dry friction in an axle's struts"}
HEIGHT = Sensor(noise=1e-4, step=2e-5)  # m, string potentiometers
RATE = 500.0
STEP = 1e-3  # s
HELD = 0.5  # s before the release
BEND = 1e-4  # m, by which a strut gives before it slides
DECIMALS = 6


@dataclass(frozen=True)
class Rig:
    """A quarter or half car; front axle first, SI."""

    sprung_mass: float
    pitch_inertia: float
    unsprung_mass: tuple[float, ...]
    arms: tuple[float, ...]  # of the axles ahead of the body's center
    stiffness: tuple[float, ...]
    damping: tuple[float, ...]
    tire_stiffness: float
    friction: float = 0.0
    knee: float = np.inf  # m/s, rate beyond which the dampers have the share ``beyond`` of their slope
    beyond: float = 1.0

    @property
    def axles(self) -> tuple[str, ...]:
        return ("front", "rear")[: len(self.arms)]

    @property
    def static(self) -> Array:
        """Loads at rest, N."""
        if len(self.arms) == 1:
            shares = np.ones(1)
        else:
            front, rear = self.arms
            shares = np.array([-rear, front]) / (front - rear)
        return GRAVITY * (self.sprung_mass * shares + np.array(self.unsprung_mass))

    def truth(self) -> dict[str, float]:
        found = {f"suspension_stiffness_{n}": k for n, k in zip(self.axles, self.stiffness, strict=True)}
        found |= {f"suspension_damping_{n}": c for n, c in zip(self.axles, self.damping, strict=True)}
        return {**found, "tire_vertical_stiffness": self.tire_stiffness}

    def known(self) -> dict[str, float]:
        """What the tester weighs and measures."""
        masses = {f"unsprung_mass_{n}": m for n, m in zip(self.axles, self.unsprung_mass, strict=True)}
        if len(self.arms) == 1:
            return {"sprung_mass": self.sprung_mass, **masses}
        base = self.arms[0] - self.arms[1]
        whole = self.sprung_mass + sum(self.unsprung_mass)
        to_front = (self.sprung_mass * self.arms[0] + self.unsprung_mass[1] * base) / whole
        lengths = {"wheelbase": base, "cg_to_front": to_front, "sprung_pitch_inertia": self.pitch_inertia}
        return {"mass": whole, **masses, **lengths}


def random_rig(seed: int, axles: int = 1, friction: float = 0.0) -> Rig:
    """A small car's axle, or both; per axle."""
    rng = np.random.default_rng([seed, 0xD0])
    sprung, base = float(rng.uniform(280, 420)) * axles, float(rng.uniform(1.6, 2.6))
    front = float(rng.uniform(0.42, 0.58)) * base
    arms = (front, front - base) if axles == 2 else (0.0,)
    return Rig(
        sprung,
        float(rng.uniform(0.75, 1.0)) * sprung * front * (base - front),
        tuple(rng.uniform(30, 55, axles).tolist()),
        arms,
        tuple(rng.uniform(16e3, 30e3, axles).tolist()),
        tuple(rng.uniform(250, 1200, axles).tolist()),
        float(rng.uniform(250e3, 400e3)),
        friction,
    )


def held(rig: Rig, body: Array) -> Array:
    """The state at the release: body lifted by (z, pitch), wheels hanging as springs and tires let them."""
    n = len(rig.arms)
    z, p = (body[0], body[1]) if n == 2 else (body[0], 0.0)
    above = z + np.array(rig.arms) * p
    k, weight = np.array(rig.stiffness), np.array(rig.static)
    wheel = k * above / (k + rig.tire_stiffness)
    hanging = rig.tire_stiffness * wheel > weight
    wheel = np.where(hanging, above - weight / k, wheel)
    return np.concatenate([[z, p], wheel, np.zeros(2 + n)])


def swing(rig: Rig, start: Array, times: Array) -> Array:
    """Heights (times, 2 n) of the body above each axle, then of the wheels, from the release at time 0 on."""
    return swings(rig, np.array([list(rig.truth().values())]), start[None], times)[0]


def swings(rig: Rig, values: Array, start: Array, times: Array) -> Array:
    """Heights (cars, times, 2 n) of many cars: ``values`` (cars, ...) as of ``truth``, ``start`` (cars, states)."""
    n = len(rig.arms)
    arms, mass, weight = (np.array(v) for v in (rig.arms, rig.unsprung_mass, rig.static))
    k, c, tire = values[:, :n], values[:, n : 2 * n], values[:, 2 * n :]

    def rate(x: Array) -> Array:
        y, rates, bend = x[:, 2 : 2 + n], x[:, 2 + n : 4 + 2 * n], x[:, 4 + 2 * n :]
        stretch = x[:, :1] + arms * x[:, 1:2] - y
        moving = rates[:, :1] + arms * rates[:, 1:2] - rates[:, 2:]
        opened = moving - np.clip(moving, -rig.knee, rig.knee)
        strut = k * stretch + c * (moving - (1 - rig.beyond) * opened) + rig.friction * np.clip(bend / BEND, -1.0, 1.0)
        turning = -(strut @ arms) / rig.pitch_inertia if n == 2 else np.zeros(len(x))
        falling = -strut.sum(axis=1) / rig.sprung_mass
        wheels = (strut + np.maximum(-weight, -tire * y)) / mass
        return np.hstack([rates, falling[:, None], turning[:, None], wheels, moving])

    start = np.hstack([start, np.zeros((len(start), n))])
    step = STEP if rig.friction == 0 else STEP / 2
    count = int(np.ceil(max(float(times[-1]), 0.0) / step)) + 1
    states = np.empty((count + 1, *start.shape))
    states[0] = start
    for i in range(count):
        x = states[i]
        k1 = rate(x)
        k2 = rate(x + step / 2 * k1)
        k3 = rate(x + step / 2 * k2)
        k4 = rate(x + step * k3)
        states[i + 1] = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        states[i + 1, :, 4 + 2 * n :] = np.clip(states[i + 1, :, 4 + 2 * n :], -BEND, BEND)
    at = np.clip((times / step).astype(int), 0, count - 1)
    share = (times / step - at)[:, None, None]
    x = np.swapaxes((1 - share) * states[at] + share * states[at + 1], 0, 1)
    return np.concatenate([x[:, :, :1] + x[:, :, 1:2] * arms, x[:, :, 2 : 2 + n]], axis=2)


def lifts(seed: int, axles: int, count: int) -> list[Array]:
    """Heights, m, and pitch angles, rad, at which the body is held before each drop."""
    rng = np.random.default_rng([seed, 0xD1])
    return [
        np.array([rng.uniform(0.025, 0.05), rng.uniform(-0.015, 0.015)]) if axles == 2 else rng.uniform(0.025, 0.05, 1)
        for _ in range(count)
    ]


def columns(axles: tuple[str, ...]) -> tuple[str, ...]:
    return (*(f"Body {n} [m]" for n in axles), *(f"Wheel {n} [m]" for n in axles))


def campaign(rig: Rig, seed: int, count: int = 3, duration: float = 4.0) -> list[Record]:
    """The logs of ``count`` drops, heights measured from anywhere."""
    rng = np.random.default_rng([seed, 0xD2])
    names, records = columns(rig.axles), []
    for lift in lifts(seed, len(rig.arms), count):
        times = jitter(regular(HELD + duration, RATE), 0.1, rng)
        clean = swing(rig, held(rig, lift), np.maximum(times - HELD, 0.0))
        zeros = rng.uniform(-0.02, 0.02, len(names))
        heights = [quantize(white(c + z, HEIGHT.noise, rng), HEIGHT.step) for c, z in zip(clean.T, zeros, strict=True)]
        log = {"Time [s]": times, **dict(zip(names, heights, strict=True))}
        records.append(Record(log, dict.fromkeys(log, DECIMALS)))
    return records


def information(rig: Rig, seed: int, count: int = 3, duration: float = 4.0) -> Information:
    """About ``truth``, and each drop's first heights, rates and zeros."""
    names = tuple(rig.truth())
    at = np.array(list(rig.truth().values()))
    noise = float(np.hypot(HEIGHT.noise, HEIGHT.step / 12**0.5))
    times, parts = np.arange(0.0, duration, 1 / RATE), []
    own = [i for i in range(4 + 2 * len(rig.arms)) if len(rig.arms) == 2 or i not in (1, 2 + len(rig.arms) + 1)]
    for k, lift in enumerate(lifts(seed, len(rig.arms), count)):
        start = held(rig, lift)

        def mean(batch: Array, start: Array = start) -> Array:
            first = np.tile(start, (len(batch), 1))
            first[:, own] += batch[:, len(at) :]
            return np.swapaxes(swings(rig, batch[:, : len(at)], first, times), 1, 2).reshape(len(batch), -1)

        point = np.concatenate([at, np.zeros(len(own))])
        steps = np.concatenate([1e-4 * at, np.full(len(own), 1e-5)])
        by_motion = slopes(mean, point, steps) / noise
        by_zero = np.repeat(np.eye(2 * len(rig.arms)), times.size, axis=0) / noise
        whitened = np.hstack([by_motion, by_zero])
        labels = (*names, *(f"start_{i}_{k}" for i in own), *(f"zero_{i}_{k}" for i in range(2 * len(rig.arms))))
        parts.append(Information(labels, whitened.T @ whitened))
    return total(parts)


def truth(rig: Rig) -> Mapping[str, float]:
    return rig.truth()
