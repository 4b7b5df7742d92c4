"""How the true car drives from rest to rest on a straight road: front-driven, on four tires with slip, pitching.

States: way, speed, heave, pitch and their rates, four wheel speeds, four slips, for each half-shaft its twist and the
speed of its inner end, which is a side gear of the differential, and the heights of both axles and their rates. The
planetary output's torque T i turns the carrier with the motor-generators; its pinions press on both side gears alike,
by a force that keeps the carrier's speed at the mean of theirs (a constraint with its multiplier). Locked, both turn as
one. The motors lie across the car, turn i times as fast as the wheels and the same way, and the body takes the torque
that spins them up. Slip lags, sigma s' = (w r - v) - |v| s, and drives Fx = Fz D sin(C atan(b - E (b - atan b))),
b = B s. Rolling resistance is a torque frr Fz r on each wheel: the road presses ahead of the wheel's center, so that
the same torque, one from outside, lifts the car's nose. The body pitches as in ``cg_motion``, on a spring and damper
per axle, with the wheels' spin in the balance of moments. Each axle's unsprung mass rides below them on the tires'
vertical spring, as in ``half_car``. Integrated by LSODA to a relative 1e-7.

Hidden effects (``{name: size}``, SI, nothing at zero): extra_drag_area (m^2), headwind (m/s against the way out),
road_grade (uphill on the way out), grade_profile (steepest slope of ``coast_motion.road_profile``),
speed_dependent_rolling (s/m), tire_warmup (share at the start; fades with 600 s), temperature_rolling (1/K, at
``temperature``), brake_drag and brake_drag_fading (N at the road; 20 s), driveline_drag (N at the road, front axle),
rotating_mass (kg), mass_error, wheel_radius, wheel_inertia, shaft_stiffness, shaft_damping, tire_relaxation,
slip_stiffness (shares of the known value), motor_inertia (kg m^2 at the wheels), driveline_viscous and
driveline_dry_loss (N m s and N m at the inner ends), backlash (rad, half the gap of each half-shaft), torque_gain,
torque_offset (N m), torque_delay (s), speed_scale, speed_delay (s): the sensor reads more, or late; torque_lag (s): it
reads what the torque follows. In no catalog, for controls: drag_bump (N at 15 m/s, 1.5 m/s wide).
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from math import atan, copysign, exp, sin, sqrt, tanh

import numpy as np
from scipy.integrate import solve_ivp

from tests.plant.coast_motion import road_profile
from tests.plant.sensors import Array
from tests.plant.vehicle import AIR_DENSITY, GRAVITY, Vehicle

EFFECTS = (
    *("extra_drag_area", "headwind", "road_grade", "grade_profile", "speed_dependent_rolling", "tire_warmup"),
    *("temperature_rolling", "brake_drag", "brake_drag_fading", "driveline_drag", "rotating_mass", "mass_error"),
    *("wheel_radius", "wheel_inertia", "shaft_stiffness", "shaft_damping", "tire_relaxation", "motor_inertia"),
    *("backlash", "torque_gain", "torque_offset", "torque_delay", "speed_scale", "speed_delay", "drag_bump"),
    "driveline_viscous",
    "driveline_dry_loss",
    "torque_lag",
    "slip_stiffness",
)
BRAKE_FRONT = 0.65
TOLERANCE = 1e-7
REST = 0.02  # m/s over which brakes and rolling resistance change their sense
TOUCH = 5e-5  # rad beyond the play over which flanks that touch begin to damp


@dataclass(frozen=True)
class Pedals:
    """Torques in N m, linear between knots (s): drive at the planetary output, brake of all wheels together."""

    knots: tuple[float, ...]
    drive: tuple[float, ...]
    brake: tuple[float, ...]
    uphill: float = 1.0  # -1 on the way back
    temperature: float = 20.0  # degC
    air_density: float = AIR_DENSITY
    gust: tuple[float, ...] = ()  # m/s against motion, every GUST_STEP s

    def at(self, time: float) -> tuple[float, float]:
        k = min(max(bisect_right(self.knots, time) - 1, 0), len(self.knots) - 2)
        w = (time - self.knots[k]) / (self.knots[k + 1] - self.knots[k])
        w = min(max(w, 0.0), 1.0)
        drive, brake = self.drive, self.brake
        return drive[k] + w * (drive[k + 1] - drive[k]), brake[k] + w * (brake[k + 1] - brake[k])

    def wind(self, time: float) -> float:
        if not self.gust:
            return 0.0
        k = min(int(time / GUST_STEP), len(self.gust) - 2)
        w = time / GUST_STEP - k
        return (1.0 - w) * self.gust[k] + w * self.gust[k + 1]


GUST_STEP = 0.5  # s


@dataclass(frozen=True)
class Trip:
    """True signals at the sample times."""

    speed: Array
    position: Array
    acceleration: Array
    pitch: Array
    wheel_speed: Array  # (4, samples): front left, front right, rear left, rear right
    shaft_torque: Array  # (2, samples): left, right
    slip: Array  # (4, samples)
    grade: Array


class Drive:
    """The equations of motion of one drive; ``rates`` is in plain floats, which is fastest for one small system."""

    def __init__(self, vehicle: Vehicle, pedals: Pedals, effects: Mapping[str, float] | None = None) -> None:
        unknown = set(effects or {}) - set(EFFECTS)
        if unknown:
            raise ValueError(f"a drive has no effect {sorted(unknown)}")
        q = {name: float((effects or {}).get(name, 0.0)) for name in EFFECTS}
        self.q, self.car, self.pedals = q, vehicle, pedals
        self.mass = vehicle.mass * (1.0 + q["mass_error"])
        self.radius = vehicle.wheel_radius * (1.0 + q["wheel_radius"])
        self.air = 0.5 * pedals.air_density * (vehicle.drag_area + q["extra_drag_area"])
        self.wheel = vehicle.wheel_inertia * (1.0 + q["wheel_inertia"]) + q["rotating_mass"] * self.radius**2 / 4
        self.gear = vehicle.side_gear_inertia
        self.motors = vehicle.driveline_inertia + q["motor_inertia"] - 2.0 * self.gear
        stiffer, damper = 1.0 + q["shaft_stiffness"], 1.0 + q["shaft_damping"]
        self.stiffness = vehicle.shaft_stiffness_left * stiffer, vehicle.shaft_stiffness_right * stiffer
        self.damping = vehicle.shaft_damping_left * damper, vehicle.shaft_damping_right * damper
        self.relaxation = vehicle.tire_relaxation_length * (1.0 + q["tire_relaxation"])
        self.rolling = vehicle.rolling_resistance / (1.0 + q["temperature_rolling"] * (pedals.temperature - 20.0))

    def slope(self, position: float) -> float:
        q = self.q
        profile = q["grade_profile"] * float(road_profile(np.float64(position))) if q["grade_profile"] else 0.0
        return atan(self.pedals.uphill * (q["road_grade"] + profile))

    def shaft(self, side: int, twist: float, rate: float) -> float:
        """Torque of a half-shaft; within the backlash nothing touches."""
        gap = self.q["backlash"]
        if gap:
            beyond = abs(twist) - gap
            if beyond <= 0.0:
                return 0.0
            sense = copysign(1.0, twist)
            damping = self.damping[side] * tanh(beyond / TOUCH) * rate
            return sense * max(self.stiffness[side] * beyond + sense * damping, 0.0)
        return self.stiffness[side] * twist + self.damping[side] * rate

    def final_drive(self, drive: float, left: float, right: float) -> tuple[float, float]:
        """Angular accelerations of the two side gears, from the carrier's torque and those of the half-shafts.

        Jc ac = T - 2 x, Js al = x - Tl, Js ar = x - Tr, 2 ac = al + ar, with x the pinions' torque on either gear.
        """
        if self.car.differential_locked:
            together = (drive - left - right) / (self.motors + 2.0 * self.gear)
            return together, together
        pinion = 2.0 * drive / self.motors + (left + right) / self.gear
        pinion /= 4.0 / self.motors + 2.0 / self.gear
        return (pinion - left) / self.gear, (pinion - right) / self.gear

    def tire(self, load: float, slip: float, sliding: float, speed: float) -> float:
        """Longitudinal force; near rest the tread also damps, or the car would rock on its tires for ever."""
        car = self.car
        b = car.tire_B * (1.0 + self.q["slip_stiffness"]) * (slip + 0.05 * sliding * exp(-(speed * speed)))
        return max(load, 0.0) * car.tire_D * sin(car.tire_C * atan(b - car.tire_E * (b - atan(b))))

    def struts(self, body: list[float], axles: list[float]) -> tuple[float, float]:
        """Forces up on the body beyond those at rest, N, of both axles' springs and dampers.

        ``body``: heave, pitch and their rates; ``axles``: heights of front and rear axle and their rates.
        """
        car, (z, pitch, z_rate, pitch_rate), (front, rear, front_rate, rear_rate) = self.car, body, axles
        shorter = z + car.cg_to_front * pitch - front, z - car.cg_to_rear * pitch - rear
        faster = z_rate + car.cg_to_front * pitch_rate - front_rate, z_rate - car.cg_to_rear * pitch_rate - rear_rate
        return (
            -car.suspension_stiffness_front * shorter[0] - car.suspension_damping_front * faster[0],
            -car.suspension_stiffness_rear * shorter[1] - car.suspension_damping_rear * faster[1],
        )

    def rates(self, time: float, state: list[float]) -> list[float]:
        position, speed, body, axles = state[0], state[1], state[2:6], state[18:22]
        spin, slip, (twist_l, twist_r), (inner_l, inner_r) = state[6:10], state[10:14], state[14:16], state[16:18]
        q, car, radius = self.q, self.car, self.radius
        drive, brake = self.pedals.at(time)
        wind = self.pedals.wind(time) + self.pedals.uphill * q["headwind"]
        slope = self.slope(position)
        heavier, tires = self.mass / car.mass * sqrt(1.0 - sin(slope) ** 2), car.tire_vertical_stiffness
        loads = car.front_load * heavier - tires * axles[0], car.rear_load * heavier - tires * axles[1]
        struts = self.struts(body, axles)
        torque = self.shaft(0, twist_l, inner_l - spin[0]), self.shaft(1, twist_r, inner_r - spin[1]), 0.0, 0.0
        rolling = self.rolling * (1.0 + q["tire_warmup"] * exp(-time / 600.0)) + q["speed_dependent_rolling"] * speed
        drag = q["brake_drag"] + q["brake_drag_fading"] * exp(-time / 20.0)
        spin_rates, slip_rates, pull, ahead = [], [], 0.0, 0.0
        for k in range(4):
            rim, load = spin[k] * radius, 0.5 * loads[0 if k < 2 else 1]
            sliding = rim - speed
            force = self.tire(load, slip[k], sliding, speed)
            share = 0.5 * (BRAKE_FRONT if k < 2 else 1.0 - BRAKE_FRONT)
            sense, tread = tanh(rim / REST), rolling * load * radius
            loss = brake * share + (0.25 * drag + (0.5 * q["driveline_drag"] if k < 2 else 0.0)) * radius + tread
            spin_rates.append((torque[k] - loss * sense - force * radius) / self.wheel)
            slip_rates.append((sliding - abs(speed) * slip[k]) / self.relaxation)
            pull, ahead = pull + force, ahead + tread * sense
        air = self.air * (speed + wind) * abs(speed + wind)
        if q["drag_bump"]:
            air += q["drag_bump"] * exp(-0.5 * ((speed - 15.0) / 1.5) ** 2)
        acceleration = (pull - air) / self.mass - GRAVITY * sin(slope)
        lift = (struts[0] + struts[1]) / (self.mass - car.unsprung_mass)
        moment = car.cg_to_front * struts[0] - car.cg_to_rear * struts[1] + car.cg_height * pull
        inner = 0.5 * (inner_l + inner_r)
        loss = q["driveline_viscous"] * inner + q["driveline_dry_loss"] * tanh(inner * radius / REST)
        faster = self.final_drive(drive * car.gear_ratio - loss, torque[0], torque[1])
        moment += air * (car.drag_height - car.cg_height) + self.wheel * sum(spin_rates) + ahead
        moment += self.motors / car.gear_ratio * 0.5 * sum(faster)
        return [
            self.pedals.uphill * speed, acceleration, *body[2:], lift, moment / car.pitch_inertia,
            *spin_rates, *slip_rates, inner_l - spin[0], inner_r - spin[1],
            *faster, *axles[2:],
            -(tires * axles[0] + struts[0]) / car.unsprung_mass_front,
            -(tires * axles[1] + struts[1]) / car.unsprung_mass_rear,
        ]  # fmt: skip

    def rest(self, position: float) -> list[float]:
        """The state at rest at this road coordinate, half-shafts in the middle of their play."""
        return [position] + [0.0] * 21

    def travel(self, times: Array, start: float = 0.0, tolerance: float = TOLERANCE) -> Trip:
        """The true signals at ``times`` of a drive that begins at rest at road coordinate ``start``."""
        solution = solve_ivp(
            lambda t, x: self.rates(t, x.tolist()), (0.0, float(times[-1])), self.rest(start), "LSODA", times,
            rtol=tolerance, atol=1e-2 * tolerance, max_step=0.2,
        )  # fmt: skip
        state = solution.y
        rates = np.array([self.rates(t, x) for t, x in zip(times.tolist(), state.T.tolist(), strict=True)]).T
        torque = [
            [self.shaft(side, a, b) for a, b in zip(state[14 + side], rates[14 + side], strict=True)] for side in (0, 1)
        ]
        grade = np.tan([self.slope(x) for x in state[0]])
        return Trip(state[1], state[0], rates[1], state[3], state[6:10], np.array(torque), state[10:14], grade)
