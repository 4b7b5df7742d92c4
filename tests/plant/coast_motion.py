"""How the true car rolls on a road with wind: forces, hidden effects, integration of all runs of a campaign at once.

The car is a mass with rolling wheels: (M + J/r^2) V' = T i / r - air - rolling - extras - M g sin(grade), integrated by
the implicit midpoint rule (kinetic energy changes by exactly the work done) in 0.1 s steps. Position is the road's
coordinate: it rises on the way out and falls on the way back.

Hidden effects (``{name: size}``, SI, nothing at zero) change the truth, never what the tester knows:

=========================  ===========================================================================================
extra_drag_area            m^2 on top of the vehicle's
headwind                   m/s against the way out, helping on the way back
road_grade                 constant slope, uphill on the way out
grade_profile              steepest slope of a fixed road profile (see ``road_profile``), mirrored on the way back
speed_dependent_rolling    s/m: rolling coefficient + size x speed
tire_warmup                share by which rolling is higher when the day begins; fades with ``tire_warmup_time`` (600 s)
temperature_rolling        1/K: rolling / (1 + size (T - 20 degC)), T of each run
brake_drag                 N at the road, constant
brake_drag_fading          N at the road at each run's start; fades with ``brake_drag_fading_time`` (20 s)
slow_release               N at the road at each run's start; a half of it is left after 15 s, a third after 30 s ...
driveline_drag             N at the road; ``driveline_drag_viscous`` N s/m adds to it
rotating_mass              kg of rotating mass that the tester does not know
mass_error                 the true mass is (1 + size) x the known one
wheel_radius               share by which the true radius exceeds the known one (powered drives)
drag_bump                  N at 15 m/s, 1.5 m/s wide: outside every catalog, for controls
fast_drag                  N s^2/m^2 x (V - 20 m/s)^2 above 20 m/s (waves in the tires): outside every catalog
speed_scale                sensor: reads (1 + size) x
speed_delay                sensor: s of latency on top of its own
torque_gain, torque_offset sensor: reads (1 + size) T + offset (N m)
accelerometer_offset       sensor: m/s^2; accelerometer_tilt: rad nose-up; body_pitch: rad nose-up per m/s^2
=========================  ===========================================================================================
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tests.plant.sensors import Array
from tests.plant.vehicle import GRAVITY, Vehicle

STEP = 0.1  # s
BLOCK, RAMP = 10.0, 2.0  # s: drive torque holds a level for a block, which begins with a ramp
EFFECTS = (
    *("extra_drag_area", "headwind", "road_grade", "grade_profile", "speed_dependent_rolling"),
    *("tire_warmup", "tire_warmup_time", "temperature_rolling", "brake_drag", "brake_drag_fading"),
    *("brake_drag_fading_time", "driveline_drag", "driveline_drag_viscous", "rotating_mass", "mass_error"),
    *("wheel_radius", "drag_bump", "fast_drag", "speed_scale", "speed_delay", "torque_gain", "torque_offset"),
    *("slow_release", "accelerometer_offset", "accelerometer_tilt", "body_pitch"),
)


@dataclass(frozen=True)
class Plan:
    """What is decided before driving: it stays put when the truth is varied for a sensitivity."""

    heading: Array  # +1 out, -1 back
    start: Array  # s since the day began
    speed: Array  # m/s at each run's start
    position: Array  # m, road coordinate at each run's start
    temperature: Array  # degC
    samples: tuple[Array, ...]  # sample times of each run, s
    torque: Array  # N m at the planetary output, (blocks, runs)

    @property
    def steps(self) -> int:
        return int(np.ceil(max(times[-1] for times in self.samples) / STEP)) + 2


@dataclass(frozen=True)
class Scatter:
    """What differs from run to run and within runs."""

    gust: Array  # m/s against motion, (steps, runs)
    wind: Array  # m/s against motion, of each run
    rolling: Array  # share, of each run


@dataclass(frozen=True)
class Motion:
    """The true motion of all runs on the fine clock; arrays (steps + 1, runs)."""

    clock: Array
    speed: Array
    position: Array
    acceleration: Array  # mean over each step, (steps, runs)
    grade: Array  # uphill in the run's own direction


def calm(runs: int, steps: int) -> Scatter:
    return Scatter(np.zeros((steps, runs)), np.zeros(runs), np.zeros(runs))


def road_profile(position: Array) -> Array:
    """Slope of the road against its coordinate, steepest about 1: three dips and crests of different length."""
    dips = ((180.0, 60.0, 1.0), (420.0, 90.0, -0.7), (760.0, 120.0, 0.6))  # middle m, half-length m, height
    u = [(position - middle) / length for middle, length, _ in dips]
    return np.asarray(sum(d[2] * -2.0 * x * np.exp(0.5 - 2.0 * x**2) for d, x in zip(dips, u, strict=True)))


class Car:
    """The forces on the car, with the hidden effects in."""

    def __init__(self, vehicle: Vehicle, air_density: float, plan: Plan, effects: Mapping[str, float]) -> None:
        unknown = set(effects) - set(EFFECTS)
        if unknown:
            raise ValueError(f"a coast-down has no effect {sorted(unknown)}")
        q = {name: float(effects.get(name, 0.0)) for name in EFFECTS}
        self.q, self.plan = q, plan
        self.mass = vehicle.mass * (1.0 + q["mass_error"])
        self.inertia = self.mass + vehicle.rotating_mass + q["rotating_mass"]
        self.drag = 0.5 * air_density * (vehicle.drag_area + q["extra_drag_area"])
        self.warm_time = effects.get("tire_warmup_time", 600.0)
        self.fade_time = effects.get("brake_drag_fading_time", 20.0)
        self.rolling = vehicle.rolling_resistance / (1.0 + q["temperature_rolling"] * (plan.temperature - 20.0))
        self.force_per_torque = vehicle.gear_ratio / (vehicle.wheel_radius * (1.0 + q["wheel_radius"]))
        self.constant_force = q["brake_drag"] + q["driveline_drag"]
        self.flat = not (q["road_grade"] or q["grade_profile"])

    def grade(self, position: Array) -> Array:
        """Slope uphill in each run's own direction."""
        if self.flat:
            return np.zeros_like(position)
        uphill_out = self.q["road_grade"] + self.q["grade_profile"] * road_profile(position)
        return self.plan.heading * uphill_out

    def torque(self, times: Array) -> Array:
        """True torque at the planetary output of every run, (times, runs)."""
        blocks = self.plan.torque
        if not blocks.size:
            return np.zeros((times.size, self.plan.speed.size))
        begin = BLOCK * np.arange(len(blocks))
        knots = np.stack([begin, begin + RAMP], axis=1).ravel()
        levels = np.stack([np.vstack([np.zeros_like(blocks[:1]), blocks[:-1]]), blocks], axis=1)
        levels = levels.reshape(-1, blocks.shape[1])
        return np.stack([np.interp(times, knots, level) for level in levels.T], axis=1)

    def acceleration(self, time: float, speed: Array, position: Array, wind: Array, excess: Array) -> Array:
        """dV/dt of every run ``time`` s into it, without drive; ``wind`` against motion, ``excess`` of rolling.

        What is zero is left out: tests take this step some hundred thousand times.
        """
        q = self.q
        air = speed + wind
        coefficient = self.rolling * (1.0 + excess)
        if q["tire_warmup"]:
            coefficient = coefficient * (1.0 + q["tire_warmup"] * np.exp(-(self.plan.start + time) / self.warm_time))
        if q["speed_dependent_rolling"]:
            coefficient = coefficient + q["speed_dependent_rolling"] * speed
        weight = self.mass * GRAVITY
        slope = None if self.flat else np.arctan(self.grade(position))
        friction = coefficient * (weight if slope is None else weight * np.cos(slope)) + self.constant_force
        if q["brake_drag_fading"]:
            friction = friction + q["brake_drag_fading"] * np.exp(-time / self.fade_time)
        if q["slow_release"]:
            friction = friction + q["slow_release"] * 15.0 / (15.0 + time)
        resistance = self.drag * air * np.abs(air) + friction * np.tanh(speed / 0.02)
        if q["drag_bump"]:
            resistance = resistance + q["drag_bump"] * np.exp(-0.5 * ((speed - 15.0) / 1.5) ** 2)
        if q["fast_drag"]:
            resistance = resistance + q["fast_drag"] * np.maximum(speed - 20.0, 0.0) ** 2
        if q["driveline_drag_viscous"]:
            resistance = resistance + q["driveline_drag_viscous"] * speed
        if slope is not None:
            resistance = resistance + weight * np.sin(slope)
        return np.asarray(resistance / -self.inertia)

    def wind_response(self, motion: Motion) -> tuple[Array, Array]:
        """How strongly a little wind pulls, and how fast its trace in the speed decays, both 1/s, (steps + 1, runs)."""
        pull = 2.0 * self.drag * np.abs(motion.speed + self.q["headwind"] * self.plan.heading) / self.inertia
        by_speed = self.q["driveline_drag_viscous"] + self.q["speed_dependent_rolling"] * self.mass * GRAVITY
        return pull, pull + by_speed / self.inertia

    def move(self, scatter: Scatter, steps: int, step: float = STEP) -> Motion:
        """The true motion; the midpoint is found by fixed-point rounds, each good for three digits at this step."""
        plan = self.plan
        speed, position = np.empty((2, steps + 1, plan.speed.size))
        rate = np.empty((steps, plan.speed.size))
        speed[0], position[0] = plan.speed, plan.position
        drive = self.torque((np.arange(steps) + 0.5) * step) * self.force_per_torque / self.inertia
        wind = scatter.gust + scatter.wind + self.q["headwind"] * plan.heading
        now = drive[0]
        for k in range(steps):
            v, x, time = speed[k], position[k], (k + 0.5) * step
            for _ in range(2):
                middle = v + 0.5 * step * now
                along = x + 0.5 * step * middle * plan.heading
                now = drive[k] + self.acceleration(time, middle, along, wind[k], scatter.rolling)
            rate[k], speed[k + 1] = now, v + step * now
            position[k + 1] = x + step * (v + 0.5 * step * now) * plan.heading
        return Motion(np.arange(steps + 1) * step, speed, position, rate, self.grade(position))
