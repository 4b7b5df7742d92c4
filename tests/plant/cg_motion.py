"""How the true car pitches and loads its axles while it is driven and braked hard, with the effects that can be hidden.

The car is one rigid body (mass M, pitch inertia I about its center at height h) that heaves and pitches on a spring and
damper per axle, on tires that do not give way vertically, while drive and brake forces act at the road and drag at its
own height. With a the acceleration of the center, w the wheels' speed, all four wheels' inertia J and nose-up pitch th,

    I th'' = lf Ff - lr Fr + h (M a + Fd + M g sin(grade)) + Fd (hd - h) + J w' + c r M g cos(grade),
    M z'' = Ff + Fr - M g cos(grade),
    r w = V + u,   u = V k + sigma k',   k = a / (g BCD),

with u the tires' sliding speed at the slip k that their force needs, which builds up over the relaxation length sigma,
and c r M g the moment of rolling resistance: the road pushes a rolling tire up ahead of its hub. The first is the
paper's load transfer if that and the heave z are left out, **except for J w'**: spinning wheels up takes load off the
front axle too, as if M h were larger by J/r (1.6 %). The antenna at height H feels a - (H - h) th''. The pitching is
linear, so it is stepped exactly by a matrix exponential, with its drive linear between 5 ms points.

Hidden effects (``{name: size}``, SI, nothing at zero):

====================================  =================================================================================
accelerometer_tilt                    rad nose-up: the antenna's acceleration also holds g sin(size)
accelerometer_offset                  m/s^2
wheel_force_gain                      all wheel loads read (1 + size) x; ``wheel_force_gain_front``: the front ones
clock_offset                          s by which the wheel loads are logged late
acceleration_delay                    s by which the acceleration is logged late
acceleration_lag                      s, time constant of a low-pass filter of the acceleration
road_grade                            uphill on the way out
aero_lift                             m^2 of lift area, half on each axle; ``aero_lift_front``, ``aero_lift_rear``
unsprung_mass                         kg of each axle that bounces on the tires' spring instead of standing still
own_axles                             share of the car's own axle masses that bounces likewise
pitch_axis                            m below the center of the axis the body pitches about: the center moves as it does
load_crosstalk                        share of each wheel's longitudinal force that its load cell feels;
                                      ``load_crosstalk_front``: at the front axle only
load_compression                      share of the front load above that at rest that the load cells do not read
pitch_rate_gain                       the gyro reads (1 + size) x
====================================  =================================================================================
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import expm

from tests.plant.sensors import Array
from tests.plant.vehicle import AIR_DENSITY, GRAVITY, Vehicle

STEP = 0.005  # s
EFFECTS = (
    *("accelerometer_tilt", "accelerometer_offset", "wheel_force_gain", "wheel_force_gain_front", "clock_offset"),
    *("road_grade", "aero_lift", "aero_lift_front", "aero_lift_rear", "unsprung_mass", "pitch_axis", "load_crosstalk"),
    *("load_crosstalk_front", "load_compression", "pitch_rate_gain", "acceleration_delay", "accelerometer_gain"),
    *("acceleration_lag", "own_axles"),
)


def sizes(effects: Mapping[str, float] | None) -> dict[str, float]:
    """Every effect's size, zero where it is not named."""
    unknown = set(effects or {}) - set(EFFECTS)
    if unknown:
        raise ValueError(f"an accelerate-and-brake run has no effect {sorted(unknown)}")
    return {name: float((effects or {}).get(name, 0.0)) for name in EFFECTS}


@dataclass(frozen=True)
class Pedals:
    """What the driver asks for: acceleration before drag (m/s^2), linear between knots (s), from a start speed."""

    start_speed: float
    knots: Array
    wanted: Array
    uphill: float  # +1 out, -1 back: the way a road grade counts
    air_density: float = AIR_DENSITY


@dataclass(frozen=True)
class Ride:
    """True signals at some times; loads of whole axles, at the road; ``force``: longitudinal at the road."""

    speed: Array
    acceleration: Array  # of the center of gravity
    pitch: Array
    pitch_rate: Array
    pitch_acceleration: Array
    heave_acceleration: Array
    front: Array
    rear: Array
    force: Array
    drag: Array
    sliding_rate: Array  # m/s^2, of the tires' sliding speed


class Body:
    """The car on its springs, driven by ``pedals`` until ``end`` (s)."""

    def __init__(
        self, vehicle: Vehicle, pedals: Pedals, end: float, effects: Mapping[str, float] | None = None
    ) -> None:
        q = sizes(effects)
        self.vehicle, self.pedals = vehicle, pedals
        own = np.array([vehicle.unsprung_mass_front, vehicle.unsprung_mass_rear])
        self.axles = q["unsprung_mass"] + q["own_axles"] * own
        self.slope = float(np.arctan(q["road_grade"] * pedals.uphill))
        self.lift = 0.5 * q["aero_lift"] + np.array([q["aero_lift_front"], q["aero_lift_rear"]])
        self.clock = STEP * np.arange(int(np.ceil(end / STEP)) + 3)
        self.air = 0.5 * pedals.air_density * vehicle.drag_area
        self.speed = self._speeds()
        self.slide = self._sliding()
        self.a, self.b = _matrices(vehicle, self.axles, q["pitch_axis"])
        push = self._push(self.speed, self._acceleration(self.clock, self.speed), self.slide)
        self.state = _pitching(self.a, self.b, push)
        self.rate = self.state @ self.a.T + push @ self.b.T

    def _acceleration(self, times: Array, speed: Array) -> Array:
        pedals = self.pedals
        return np.interp(times, pedals.knots, pedals.wanted) - self.air * speed**2 / self.vehicle.mass

    def _speeds(self) -> Array:
        """Heun's method."""
        wanted = np.interp(self.clock, self.pedals.knots, self.pedals.wanted).tolist()
        fade, v = self.air / self.vehicle.mass, self.pedals.start_speed
        speed = [v]
        for now, then in pairwise(wanted):
            before = now - fade * v * v
            guess = v + STEP * before
            v += 0.5 * STEP * (before + then - fade * guess * guess)
            speed.append(v)
        return np.array(speed)

    def _sliding(self) -> Array:
        """The rate of the tires' sliding speed, m/s^2."""
        car = self.vehicle
        slip = self._acceleration(self.clock, self.speed) / (GRAVITY * car.tire_longitudinal_stiffness)
        slide = self.speed * slip + car.tire_relaxation_length * np.gradient(slip, STEP)
        return np.gradient(slide, STEP)

    def _push(self, speed: Array, acceleration: Array, slide: Array) -> Array:
        """Forces on heave (N) and pitch (N m, nose-up) that do not come from the springs."""
        car = self.vehicle
        drag = self.air * speed**2
        force = car.mass * (acceleration + GRAVITY * np.sin(self.slope)) + drag
        spin = 4 * car.wheel_inertia * (acceleration + slide) / car.wheel_radius
        lift = 0.5 * self.pedals.air_density * np.outer(speed**2, self.lift)
        moment = car.cg_height * force + drag * (car.drag_height - car.cg_height) + spin
        moment = moment + lift @ [car.cg_to_front, -car.cg_to_rear]
        moment = moment + car.rolling_resistance * car.wheel_radius * car.mass * GRAVITY * np.cos(self.slope)
        return np.column_stack([lift.sum(axis=1), moment])

    def at(self, times: Array) -> Ride:
        """The true signals at ``times``, from the state by cubic Hermite between grid points."""
        car, half = self.vehicle, len(self.a) // 2
        k = np.clip((times / STEP).astype(int), 0, self.clock.size - 2)
        w = (times / STEP - k)[:, None]
        start, end, rise, fall = self.state[k], self.state[k + 1], STEP * self.rate[k], STEP * self.rate[k + 1]
        state = (1 - w) ** 2 * ((1 + 2 * w) * start + w * rise) + w**2 * ((3 - 2 * w) * end + (w - 1) * fall)
        speed = np.interp(times, self.clock, self.speed)
        acceleration = self._acceleration(times, speed)
        slide = np.interp(times, self.clock, self.slide)
        rate = state @ self.a.T + self._push(speed, acceleration, slide) @ self.b.T
        front, rear = self._loads(state)
        force = car.mass * (acceleration + GRAVITY * np.sin(self.slope)) + self.air * speed**2
        return Ride(
            speed, acceleration, state[:, 1], state[:, half + 1], rate[:, half + 1], rate[:, half],
            car.front_load * np.cos(self.slope) + front, car.rear_load * np.cos(self.slope) + rear,
            force, self.air * speed**2, slide,
        )  # fmt: skip

    def _loads(self, state: Array) -> tuple[Array, Array]:
        """What the axles carry on top of the static load."""
        car = self.vehicle
        if self.axles.any():
            return -car.tire_vertical_stiffness * state[:, 2], -car.tire_vertical_stiffness * state[:, 3]
        z, pitch, z_rate, pitch_rate = state.T
        front = car.suspension_stiffness_front * (z + car.cg_to_front * pitch)
        front = front + car.suspension_damping_front * (z_rate + car.cg_to_front * pitch_rate)
        rear = car.suspension_stiffness_rear * (z - car.cg_to_rear * pitch)
        rear = rear + car.suspension_damping_rear * (z_rate - car.cg_to_rear * pitch_rate)
        return -front, -rear


def _matrices(car: Vehicle, axles: Array, pitch_axis: float) -> tuple[Array, Array]:
    """A and B of state' = A state + B (heave force, pitch moment), about rest.

    State: displacements, then rates, of body heave and nose-up pitch, and of both axles if their masses ``axles``, kg,
    front and rear, are not zero.
    """
    body = car.mass - axles.sum()
    lr = (car.mass * car.cg_to_rear - axles[0] * car.wheelbase) / body
    stretch = np.array([[1.0, car.wheelbase - lr, -1.0, 0.0], [1.0, -lr, 0.0, -1.0]])  # of each axle's spring
    stiffness = stretch.T @ np.diag([car.suspension_stiffness_front, car.suspension_stiffness_rear]) @ stretch
    damping = stretch.T @ np.diag([car.suspension_damping_front, car.suspension_damping_rear]) @ stretch
    stiffness += np.diag([0.0, -car.mass * GRAVITY * pitch_axis, *[car.tire_vertical_stiffness] * 2])
    free = 4 if axles.any() else 2  # without axle mass the wheels stand still
    inverse = np.diag(1.0 / np.array([body, car.pitch_inertia, *axles])[:free])
    zero, one = np.zeros((free, free)), np.eye(free)
    a = np.block([[zero, one], [-inverse @ stiffness[:free, :free], -inverse @ damping[:free, :free]]])
    return a, np.vstack([zero, inverse])[:, :2]


def _pitching(a: Array, b: Array, push: Array) -> Array:
    """State at each step under forces that rise linearly from step to step, settled before the first; exact."""
    n = len(a)
    # The exponential of [[A, B, 0], [0, 0, 1/dt], [0, 0, 0]] dt holds the response to a level and to a ramp.
    block = np.zeros((n + 4, n + 4))
    block[:n, :n], block[:n, n : n + 2], block[n : n + 2, n + 2 :] = a * STEP, b * STEP, np.eye(2)
    whole = expm(block)
    keep, level, ramp = whole[:n, :n], whole[:n, n : n + 2], whole[:n, n + 2 :]
    forced = push[:-1] @ level.T + np.diff(push, axis=0) @ ramp.T
    state = np.empty((len(push), n))
    state[0] = np.linalg.solve(a, -b @ push[0])
    for k, force in enumerate(forced):
        state[k + 1] = keep @ state[k] + force
    return state
