"""A wheel on a stand: a motor spins it up and lets it run down, over and over; its bearing drags.

    w' = (T(t) - D(w)) / J,    D(w) = d0 + d1 w  (+ d2 w^2, the air)

T is a series of levels behind a lag; the motion is integrated by Runge and Kutta's fourth-order steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from tests.plant.information import Array, Information, effect_slopes, from_constraints, prior, total
from tests.plant.sensors import WHEEL_SPEED, Record, Sensor, jitter, quantize, read, regular, white
from tests.plant.vehicle import Vehicle

EFFECTS = {
    "air": "N m s^2/rad^2 of air about the wheel",
    "torque_gain": "1: the torque channel reads (1 + q) times the torque",
}
SMALL = {"air": 1e-6, "torque_gain": 1e-4}
RATE = 100.0
FINE = 1e-3  # s
START = 10.0  # rad/s
LAG = 0.1  # s, of the motor's torque
TORQUE = Sensor(noise=0.3, step=0.05, zero=0.3)
SPEED = WHEEL_SPEED.but(noise=0.05, step=0.02)
DECIMALS = {"Time [s]": 5, "Torque [N m]": 2, "Wheel Speed [rad/s]": 2}


@dataclass(frozen=True)
class Spin:
    """One run: sample times, and the levels of the torque, N m, from given times on."""

    times: Array
    switch: Array
    level: Array


def drag(seed: int) -> dict[str, float]:
    """Bearing, seals and pads of a wheel: N m at standstill, N m s/rad."""
    rng = np.random.default_rng([seed, 0x51])
    return {"bearing_torque": float(rng.uniform(0.5, 3.0)), "bearing_viscous": float(rng.uniform(0.005, 0.03))}


def truth(vehicle: Vehicle, seed: int) -> dict[str, float]:
    return {"wheel_inertia": vehicle.wheel_inertia, **drag(seed)}


def spins(vehicle: Vehicle, seed: int, count: int = 3, duration: float = 60.0) -> list[Spin]:
    """The torque is on until the wheel is fast, and off or against it until it is slow, each time another one."""
    rng, d = np.random.default_rng([seed, 0x52]), drag(seed)
    found = []
    for _ in range(count):
        switch, level, now, speed = list[float](), list[float](), 0.0, START
        while now < duration:
            for push, wanted in (
                (rng.uniform(10.0, 25.0), rng.uniform(50.0, 90.0)),
                (rng.uniform(-8.0, 0.0), rng.uniform(10.0, 20.0)),
            ):
                slowing = d["bearing_torque"] + d["bearing_viscous"] * (speed + wanted) / 2
                switch.append(now)
                level.append(float(push))
                now += vehicle.wheel_inertia * (wanted - speed) / (push - slowing)
                speed = wanted
        found.append(Spin(jitter(regular(duration, RATE), 0.1, rng), np.array(switch), np.array(level)))
    return found


def noise_free(
    vehicle: Vehicle, seed: int, spin: Spin, effects: Mapping[str, float] | None = None
) -> tuple[Array, Array]:
    """Torque, N m, and speed, rad/s, as perfect sensors would log them."""
    q, d = effects or {}, drag(seed)
    clock = FINE / 2 * np.arange(2 * (int(spin.times[-1] / FINE) + 2) + 1)
    torque = np.zeros_like(clock)
    for when, step in zip(spin.switch, np.diff(spin.level, prepend=0.0), strict=True):
        torque += step * (1.0 - np.exp(-np.maximum(clock - when, 0.0) / LAG))

    dry, viscous, air, inertia = d["bearing_torque"], d["bearing_viscous"], q.get("air", 0.0), vehicle.wheel_inertia

    def rate(t: float, w: float) -> float:
        return (t - (dry + viscous * w + air * w * abs(w))) / inertia

    pushed, speed = torque.tolist(), [START]
    for k in range(clock.size // 2):
        w, (a, b, c) = speed[k], pushed[2 * k : 2 * k + 3]
        k1 = rate(a, w)
        k2 = rate(b, w + FINE / 2 * k1)
        k3 = rate(b, w + FINE / 2 * k2)
        k4 = rate(c, w + FINE * k3)
        speed.append(w + FINE / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
    gain = 1.0 + q.get("torque_gain", 0.0)
    return np.interp(spin.times, clock, torque) * gain, np.interp(spin.times, clock[::2], speed)


def campaign(
    vehicle: Vehicle, seed: int, effects: Mapping[str, float] | None = None, count: int = 3, duration: float = 60.0
) -> list[Record]:
    """The logs, noise and all."""
    rng = np.random.default_rng([seed, 0x53])
    records = []
    for spin in spins(vehicle, seed, count, duration):
        torque, speed = noise_free(vehicle, seed, spin, effects)
        columns = {"Time [s]": spin.times, "Torque [N m]": read(TORQUE, torque, rng)}
        columns["Wheel Speed [rad/s]"] = read(SPEED, speed, rng)
        records.append(Record(columns, DECIMALS))
    return records


def with_current(
    records: list[Record], constant: float, spread: tuple[float, float], rng: np.random.Generator
) -> list[Record]:
    """The logs with a motor's current, A, in the place of the torque; ``constant`` N m at the wheel per ampere."""
    noise, step = spread
    found = []
    for record in records:
        current = quantize(white(record["Torque [N m]"] / constant, noise, rng), step)
        columns = {n: v for n, v in record.columns.items() if n != "Torque [N m]"}
        found.append(Record({**columns, "Motor Current [A]": current}, DECIMALS))
    return found


def information(vehicle: Vehicle, seed: int, unknowns: tuple[str, ...] = (), count: int = 3) -> Information:
    """About inertia, both drags, the effects in ``unknowns`` and each run's torque zero.

    Over each sampling interval J times the change of speed is the mean net torque at its ends; every reading is noisy.
    """
    d, parts = drag(seed), []
    sd_torque, sd_speed = (float(np.hypot(s.noise, s.step / 12**0.5)) for s in (TORQUE, SPEED))
    for k, spin in enumerate(spins(vehicle, seed, count)):
        _, speed = noise_free(vehicle, seed, spin)
        dt, mean = np.diff(spin.times), (speed[1:] + speed[:-1]) / 2

        def beyond(hidden: Mapping[str, float], spin: Spin = spin) -> Array:
            push, turn = noise_free(vehicle, seed, spin, hidden)
            net = push - d["bearing_torque"] - d["bearing_viscous"] * turn
            return np.asarray((net[1:] + net[:-1]) / 2 * np.diff(spin.times) - vehicle.wheel_inertia * np.diff(turn))

        own = np.column_stack([np.diff(speed), dt, mean * dt, dt])
        by_effect = effect_slopes(partial(beyond), {}, unknowns, SMALL)
        band = np.zeros((2, dt.size))
        band[0] = 2 * (vehicle.wheel_inertia * sd_speed) ** 2 + dt**2 / 2 * sd_torque**2
        band[1, :-1] = -((vehicle.wheel_inertia * sd_speed) ** 2) + dt[1:] * dt[:-1] / 4 * sd_torque**2
        names = ("wheel_inertia", "bearing_torque", "bearing_viscous", f"zero_{k}", *unknowns)
        parts += [from_constraints(names, np.hstack([own, by_effect]), band), prior({f"zero_{k}": TORQUE.zero})]
    return total(parts)
