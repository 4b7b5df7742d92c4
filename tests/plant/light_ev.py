"""A light electric vehicle (cargo bike, kart, microcar) driven through a town cycle, and how its logger sees that.

One wheel speed is the state; all torques are taken at the driven wheels::

    (Jw + M r^2 + Jm i^2) w' = i eta T - c w - r (frr M g tanh(v / 0.05) + 1/2 rho CdA (v + u)|v + u|),  v = w r

with the motor's torque T after a current loop of first order, c a viscous loss of the driveline (N m s at the wheels)
and u a gust. Heun's method, 5 ms. It shares no law with ``drive_motion``: no slip, no shafts, no pitching, no brakes
(the motor brakes), the motor's own inertia and torque lag. Imports nothing from the program.

Faults (``{name: size}``, nothing at zero). In the logs: torque_gain (the torque reads (1 + e) T), speed_scale (the
speed reads k V: 3.6 for km/h read as m/s; 1 is nothing). In the vehicle: viscous (N m s), gear_loss (share of the
largest torque that the gears lose there, and in proportion to |T|^0.8 below). In the description:
stated_mass (true mass = stated (1 + q)), wheel_radius (true radius = stated (1 + q)), motor_inertia (1: the rotor is
missing in the stated rotating mass).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import tanh

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GRAVITY = 9.81
STEP = 0.005  # s
FAULTS = ("torque_gain", "speed_scale", "viscous", "gear_loss", "stated_mass", "wheel_radius", "motor_inertia")
LOSS_POWER = 0.8  # of the torque, to which the loss of gear_loss is proportional


@dataclass(frozen=True)
class LightEv:
    """The vehicle as it is, SI."""

    mass: float
    wheel_radius: float
    gear_ratio: float
    wheel_inertia: float  # all wheels together
    rotor_inertia: float  # of the motor's shaft
    efficiency: float
    rolling: float
    drag_area: float
    torque_lag: float  # s
    largest_torque: float  # N m of the motor
    air_density: float = 1.2

    @property
    def rotor_mass(self) -> float:
        """kg, the rotor's inertia as mass at the road."""
        return self.rotor_inertia * (self.gear_ratio / self.wheel_radius) ** 2

    @property
    def wheel_mass(self) -> float:
        """kg, the wheels' inertia as mass at the road."""
        return self.wheel_inertia / self.wheel_radius**2


@dataclass(frozen=True)
class Logger:
    """Sampling rate in Hz; noise and steps of its channels in SI; gusts (m/s, s) and the mean wind's scatter."""

    rate: float = 50.0
    speed_noise: float = 0.03
    speed_step: float = 0.01
    torque_noise: float = 0.005  # of the motor's largest torque
    gust: float = 0.3
    gust_time: float = 6.0
    wind: float = 0.2


def drawn(seed: int) -> LightEv:
    """A fresh vehicle of 60 to 400 kg: mass and drag are drawn together, so that it can be driven."""
    rng = np.random.default_rng([seed, 0x1E])
    mass = float(np.exp(rng.uniform(np.log(60.0), np.log(400.0))))
    radius = float(rng.uniform(0.2, 0.32))
    ratio = float(rng.uniform(4.0, 10.0))
    share = float(rng.uniform(0.04, 0.15))  # of the mass that the rotor adds
    return LightEv(
        mass=mass,
        wheel_radius=radius,
        gear_ratio=ratio,
        wheel_inertia=float(rng.uniform(0.02, 0.04)) * mass * radius**2,
        rotor_inertia=share * mass * (radius / ratio) ** 2,
        efficiency=float(rng.uniform(0.94, 0.98)),
        rolling=float(rng.uniform(0.008, 0.016)),
        drag_area=float(rng.uniform(0.35, 0.75)),
        torque_lag=float(rng.uniform(0.02, 0.12)),
        largest_torque=float(rng.uniform(1.2, 1.8)) * mass * radius / ratio,
    )


def drive(
    car: LightEv, seed: int, run: int, seconds: float, logger: Logger, faults: Mapping[str, float]
) -> dict[str, Array]:
    """One drive as logged: columns by header. The rider follows a cycle of speeds, at times after a stop."""
    unknown = set(faults) - set(FAULTS)
    if unknown:
        raise ValueError(f"a light vehicle has no fault {sorted(unknown)}")
    rng = np.random.default_rng([seed, run, 0x1F])
    count = int(seconds / STEP)
    wanted = _cycle(rng, count)
    gust = _gust(rng, count, logger)
    speed, torque = _motion(car, wanted, gust, faults)
    every = round(1.0 / (logger.rate * STEP))
    time = np.arange(0, count, every) * STEP
    speed, torque = speed[::every], torque[::every]
    noisy = speed * faults.get("speed_scale", 1.0) + logger.speed_noise * rng.standard_normal(speed.size)
    seen = (1.0 + faults.get("torque_gain", 0.0)) * torque
    seen = seen + logger.torque_noise * car.largest_torque * rng.standard_normal(seen.size)
    return {
        "t [s]": time,
        "Motor Torque [N m]": seen,
        "Speed [m/s]": np.round(noisy / logger.speed_step) * logger.speed_step,
    }


def stated(car: LightEv, seed: int, faults: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """What the tester states of the vehicle, (value, standard deviation): each off by about that, or by a fault."""
    rng = np.random.default_rng([seed, 0x20])
    turning = car.wheel_mass + (0.0 if faults.get("motor_inertia") else car.rotor_mass)
    true = {
        "mass": (car.mass / (1.0 + faults.get("stated_mass", 0.0)), 0.002),
        "rotating_mass": (turning, 0.02),
        "wheel_radius": (car.wheel_radius / (1.0 + faults.get("wheel_radius", 0.0)), 0.001),
        "rolling_resistance": (car.rolling, 0.03),
        "drag_area": (car.drag_area, 0.03),
        "driveline_efficiency": (car.efficiency, 0.002),
    }
    drawn_values = {n: (v * (1.0 + s * float(rng.standard_normal())), s * v) for n, (v, s) in true.items()}
    return {**drawn_values, "gear_ratio": (car.gear_ratio, 0.0), "air_density": (car.air_density, 0.0)}


def _cycle(rng: np.random.Generator, count: int) -> Array:
    """Speeds that the rider wants, m/s at every step: plateaus of 6 to 25 s, some of them stops."""
    wanted = np.zeros(count)
    at = int(2.0 / STEP)
    stopped = True
    while at < count:
        length = int(rng.uniform(6.0, 25.0) / STEP)
        rest = not stopped and rng.random() < 0.25
        wanted[at : at + length] = 0.0 if rest else rng.uniform(3.0, 12.5)
        at, stopped = at + length, rest
    return wanted


def _gust(rng: np.random.Generator, count: int, logger: Logger) -> Array:
    """m/s against the motion: an Ornstein-Uhlenbeck process and the run's own mean."""
    keep = float(np.exp(-STEP / logger.gust_time))
    fresh = logger.gust * np.sqrt(1.0 - keep**2) * rng.standard_normal(count)
    value, found = logger.gust * float(rng.standard_normal()), np.empty(count)
    for k, new in enumerate(fresh.tolist()):
        found[k] = value
        value = keep * value + new
    return found + logger.wind * float(rng.standard_normal())


def _motion(car: LightEv, wanted: Array, gust: Array, faults: Mapping[str, float]) -> tuple[Array, Array]:
    """Speed (m/s) and the motor's torque (N m) at every step."""
    r, i = car.wheel_radius, car.gear_ratio
    inertia = car.wheel_inertia + car.mass * r * r + car.rotor_inertia * i * i
    viscous, most = faults.get("viscous", 0.0), i * car.efficiency * car.largest_torque
    lost = faults.get("gear_loss", 0.0) * most
    tread, air = car.rolling * car.mass * GRAVITY * r, 0.5 * car.air_density * car.drag_area * r

    def rate(spin: float, torque: float, wind: float) -> float:
        flow = spin * r + wind
        loss = tread * tanh(spin * r / 0.05) + air * flow * abs(flow) + viscous * spin
        loss += lost * abs(torque / car.largest_torque) ** LOSS_POWER
        return (i * car.efficiency * torque - loss) / inertia

    spin, torque, stored = 0.0, 0.0, 0.0
    speeds, torques = np.empty(wanted.size), np.empty(wanted.size)
    for k, (aim, wind) in enumerate(zip(wanted.tolist(), gust.tolist(), strict=True)):
        speeds[k], torques[k] = spin * r, torque
        off = aim - spin * r
        stored = min(max(stored + 0.1 * off * STEP, 0.0), 0.6) if aim else 0.0
        command = car.largest_torque * min(max(0.5 * off + stored, -0.7), 1.0)
        if aim == 0.0 and spin * r < 0.3:
            command = 0.0
        first = rate(spin, torque, wind)
        later = torque + (command - torque) * STEP / car.torque_lag
        second = rate(spin + STEP * first, later, wind)
        spin, torque = max(spin + 0.5 * STEP * (first + second), 0.0), later
    return speeds, torques
