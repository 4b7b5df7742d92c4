"""How much the logs of drives can tell at best of what is wrong in a model that predicts them from the drive torque.

Nothing is fitted but what the tester doubts: every parameter is known within the spread that ``SPREAD`` gives it, and
each drive has a mean wind and sensor zeros of its own. The slopes come from one further drive each, about a car with
nothing hidden, integrated more finely than the logs; they are kept per vehicle and plan, for that is slow. What happens
below walking pace is left out: where the car stops, readings jump, and no slope tells how. What it is left with is a
speed of each drive that nobody knows to a few millimeters per second.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from tests.plant import drive
from tests.plant.drive import RIG, WHEELS, Rig
from tests.plant.drive_motion import Pedals
from tests.plant.information import Information, prior, total
from tests.plant.sensors import Array
from tests.plant.vehicle import AIR_DENSITY, Vehicle
from tests.plant.wind import Wind

# Standard deviations that a tester states: shares of the value, or (below) in its unit.
SPREAD: Mapping[str, float] = {
    "mass": 0.003,
    "rolling_resistance": 0.02,
    "drag_area": 0.02,
    "wheel_inertia": 0.02,
    "wheel_radius": 0.001,
    "driveline_inertia": 0.05,
    "tire_B": 0.03,
    "tire_relaxation_length": 0.10,
    "shaft_stiffness_left": 0.01,
    "shaft_stiffness_right": 0.01,
    "shaft_damping_left": 0.05,
    "shaft_damping_right": 0.05,
}
TOLERANCE = 1e-9
SLOPES = 128  # kept: those of two vehicles
SLOWEST = 1.0  # m/s
DEPARTURE = (
    3e-3  # m/s by which tires that creep at rest, brakes that let go and friction that breaks away may move a car
)
# Sizes of the chords: large beside the integrator's errors, small beside what bends. A parameter's error has the
# parameter's slope. Play has no slope at nothing, so its chord is a whole one.
CHORD: Mapping[str, float] = {
    "extra_drag_area": 1e-3,
    "headwind": 1e-2,
    "road_grade": 1e-5,
    "grade_profile": 2e-5,
    "speed_dependent_rolling": 1e-6,
    "tire_warmup": 2e-3,
    "brake_drag": 0.3,
    "brake_drag_fading": 0.3,
    "driveline_drag": 0.3,
    "rotating_mass": 0.5,
    "mass_error": 2e-4,
    "wheel_radius": 1e-4,
    "wheel_inertia": 2e-3,
    "tire_relaxation": 2e-3,
    "motor_inertia": 1e-2,
    "backlash": 2e-3,
    "drag_bump": 0.3,
}
SHARES = {"mass_error": "mass", "wheel_radius": "wheel_radius", "wheel_inertia": "wheel_inertia",
          "tire_relaxation": "tire_relaxation_length"}  # fmt: skip
PARAMETER_CHORD = {"rolling_resistance": 2e-3, "tire_B": 2e-3, "shaft_stiffness": 1e-3, "shaft_damping": 5e-3}  # shares
TORQUE_CHORD = {"torque_gain": 2e-4, "torque_offset": 0.02, "torque_delay": 2e-4}
ZEROS = {"Drive Torque [N m]": RIG.torque.zero, "Shaft Torque Left [N m]": RIG.shaft_torque.zero,
         "Shaft Torque Right [N m]": RIG.shaft_torque.zero, "Long Accel [m/s^2]": RIG.acceleration.zero}  # fmt: skip
# Of sensors' gains: what their data sheets leave open.
GAINS: Mapping[str, tuple[str, float]] = {"speed": ("Speed", 5e-4), "shaft_torque": ("Shaft Torque", 1e-3),
                                          "acceleration": ("Long Accel", 0.01)}  # fmt: skip
SEEN = ("Speed [km/h]", *(f"Wheel Speed {w} [rad/s]" for w in WHEELS), "Shaft Torque Left [N m]",
        "Shaft Torque Right [N m]", "Long Accel [m/s^2]")  # fmt: skip
Log = Mapping[str, Array]


@dataclass(frozen=True)
class Drives:
    """The drives of a test day, calm, as a perfect rig would log them: what slopes are chords of."""

    vehicle: Vehicle
    plans: tuple[Pedals, ...]

    def logs(self, effects: Mapping[str, float] | None = None) -> list[Log]:
        return [dict(log) for log in drive.noise_free(self.vehicle, list(self.plans), effects, None, TOLERANCE)]

    def chord(self, other: Drives, by: float, effects: Mapping[str, float] | None = None) -> list[Array]:
        """(other with ``effects`` - this) / by; each (samples, channels) of ``SEEN``."""
        pairs = zip(other.logs(effects), _calm(self), strict=True)
        return [np.column_stack([(new[h] - old[h]) / by for h in SEEN]) for new, old in pairs]


@lru_cache(SLOPES)
def _calm(drives: Drives) -> tuple[Log, ...]:
    return tuple(drives.logs())


@lru_cache(SLOPES)
def effect_slope(drives: Drives, name: str) -> list[Array]:
    """d readings / d size of a hidden effect, each drive (samples, channels).

    What the torque sensor does wrong is wrong in the prediction's input: seen from the torque that was read, the car
    was driven by less.
    """
    if name in ("speed_scale", "speed_delay"):
        return [_speed_sensor(log, name) for log in _calm(drives)]
    if name in TORQUE_CHORD:
        by = TORQUE_CHORD[name]
        plans = tuple(_as_read(plan, name, by) for plan in drives.plans)
        return [-slope for slope in drives.chord(replace(drives, plans=plans), by)]
    if name == "temperature_rolling":
        by_share = parameter_slope(drives, "rolling_resistance")
        warm = np.linspace(-8.0, 8.0, len(drives.plans))
        return [-drives.vehicle.rolling_resistance * t * s for t, s in zip(warm, by_share, strict=True)]
    if name in PARAMETER_CHORD:
        return [
            sum(getattr(drives.vehicle, f"{name}_{side}") * slopes[k] for side, slopes in _sides(drives, name).items())
            for k in range(len(drives.plans))
        ]
    return drives.chord(drives, CHORD[name], {name: CHORD[name]})


@lru_cache(SLOPES)
def parameter_slope(drives: Drives, name: str) -> list[Array]:
    """d readings / d parameter."""
    car = drives.vehicle
    for effect, parameter in SHARES.items():
        if name == parameter:
            return [slope / getattr(car, name) for slope in effect_slope(drives, effect)]
    if name == "drag_area":
        return effect_slope(drives, "extra_drag_area")
    if name == "driveline_inertia":
        return effect_slope(drives, "motor_inertia")
    by = getattr(car, name) * PARAMETER_CHORD[name.removesuffix("_left").removesuffix("_right")]
    return drives.chord(replace(drives, vehicle=car.but(**{name: getattr(car, name) + by})), by)


def _sides(drives: Drives, name: str) -> dict[str, list[Array]]:
    return {side: parameter_slope(drives, f"{name}_{side}") for side in ("left", "right")}


def _speed_sensor(log: Log, name: str) -> Array:
    slope = np.zeros((log["Time [s]"].size, len(SEEN)))
    speed = log["Speed [km/h]"]
    slope[:, 0] = speed if name == "speed_scale" else -np.gradient(speed, log["Time [s]"])
    return slope


def _as_read(plan: Pedals, name: str, by: float) -> Pedals:
    """The drive whose true torque is what the faulty sensor reads of this one."""
    if name == "torque_gain":
        return replace(plan, drive=tuple((1.0 + by) * t for t in plan.drive))
    if name == "torque_offset":
        return replace(plan, drive=tuple(t + by for t in plan.drive))
    knots = np.array(plan.knots)
    both = np.unique(np.minimum(np.concatenate([knots, knots + by]), knots[-1]))
    pulled = np.interp(both - by, knots, plan.drive)
    braked = np.interp(both, knots, plan.brake)
    return replace(plan, knots=tuple(both.tolist()), drive=tuple(pulled.tolist()), brake=tuple(braked.tolist()))


def information(
    vehicle: Vehicle,
    seed: int,
    unknowns: Sequence[str] = (),
    spread: Mapping[str, float] = SPREAD,
    plans: Sequence[Pedals] | None = None,
    rig: Rig = RIG,
    seen: Sequence[str] = SEEN,
) -> Information:
    """About the parameters ("known mass", ...) within their spread, effects, and drives' own winds, zeros, starts."""
    drives = Drives(vehicle, tuple(plans or drive.pedals(vehicle, seed)))
    shared = [*(parameter_slope(drives, name) for name in spread), *(effect_slope(drives, name) for name in unknowns)]
    gust, pushed = effect_slope(drives, "headwind"), effect_slope(drives, "torque_offset")
    stated = {f"known {name}": share * getattr(vehicle, name) for name, share in spread.items()}
    gains = {f"gain {name}": sd for name, (_, sd) in GAINS.items()}
    parts = [prior({**stated, **gains})]
    for k, (plan, log) in enumerate(zip(drives.plans, _calm(drives), strict=True)):
        own = {f"wind_{k}": plan.uphill * gust[k], f"zero Drive Torque [N m] {k}": pushed[k]}
        rolls = {"Speed": 1.0, "Wheel": 1.0 / vehicle.wheel_radius}
        own[f"departure_{k}"] = np.tile([rolls.get(h[:5], 0.0) for h in SEEN], (len(log["Time [s]"]), 1))
        for header in ZEROS:
            if header in seen:
                own[f"zero {header} {k}"] = np.tile(np.eye(len(SEEN))[SEEN.index(header)], (len(log["Time [s]"]), 1))
        readings = np.column_stack([log[header] for header in SEEN])
        scaled = [readings * [h.startswith(group) for h in SEEN] for group, _ in GAINS.values()]
        series = np.stack([*(slopes[k] for slopes in shared), *scaled, *own.values()], axis=2)
        series = series * (log["Speed [km/h]"] > SLOWEST)[:, None, None]
        kept = [SEEN.index(header) for header in seen]
        white = _whiten(vehicle, log, series[:, kept], rig, seen)
        parts.append(Information((*stated, *unknowns, *gains, *own), white.T @ white))
        parts.append(prior({f"wind_{k}": rig.wind.between_runs} if rig.wind.between_runs else {}))
        parts.append(prior({f"departure_{k}": DEPARTURE}))
        parts.append(prior({f"zero {header} {k}": sd for header, sd in ZEROS.items() if f"zero {header} {k}" in own}))
    return total(parts)


def _whiten(vehicle: Vehicle, log: Log, series: Array, rig: Rig, seen: Sequence[str]) -> Array:
    """``series`` (samples, channels, any) filtered so that the plant's noise would come out white and unit.

    Innovations of a Kalman filter over (speed error, gust), the readings of each sample taken one after the other: the
    speed error is in the speed and, over the radius, in every wheel's speed; what the gust pulls is in the
    accelerometer. Noise of the drive torque moves the speed, and half of it, geared, is in each half-shaft.
    """
    inertia = vehicle.mass + vehicle.rotating_mass
    per_torque = vehicle.gear_ratio / vehicle.wheel_radius / inertia
    speed = log["Speed [km/h]"]
    pull = AIR_DENSITY * vehicle.drag_area * np.abs(speed) / inertia
    dt = float(np.median(np.diff(log["Time [s]"])))
    read = {"Speed": rig.speed, "Wheel": rig.wheel_speed, "Shaft": rig.shaft_torque, "Long ": rig.acceleration}
    sd = np.array([np.hypot(read[h[:5]].noise, read[h[:5]].step / 12**0.5) for h in seen])
    torque = float(np.hypot(rig.torque.noise, rig.torque.step / 12**0.5))
    sd = np.where([h.startswith("Shaft") for h in seen], np.hypot(sd, 0.5 * vehicle.gear_ratio * torque), sd)
    shares = {"Speed": 1.0, "Wheel": 1.0 / vehicle.wheel_radius}
    by_speed = np.array([shares.get(h[:5], 0.0) for h in seen])
    by_pull = np.array([-float(h.startswith("Long Accel")) for h in seen])
    wind = rig.wind if rig.wind.gust else Wind(gust=1e-9)
    stay = float(np.exp(-dt / wind.time))
    fresh = np.diag([(per_torque * torque * dt) ** 2, wind.gust**2 * (1.0 - stay**2)])
    state, spread = np.zeros((2, series.shape[2])), np.diag([0.0, wind.gust**2])
    result = np.empty_like(series)
    for k in range(len(series)):
        if k:
            onward = np.array([[1.0 - dt * pull[k], -dt * pull[k]], [0.0, stay]])
            state = onward @ state
            spread = onward @ spread @ onward.T + fresh
        for j in range(len(seen)):
            felt = np.array([by_speed[j], by_pull[j] * pull[k]])
            if not felt.any():
                result[k, j] = series[k, j] / sd[j]
                continue
            carried = spread @ felt
            variance = float(felt @ carried) + sd[j] ** 2
            surprise = series[k, j] - felt @ state
            result[k, j] = surprise / variance**0.5
            state = state + np.outer(carried / variance, surprise)
            spread = spread - np.outer(carried, carried) / variance
    return result.reshape(-1, series.shape[2])


def measured(vehicle: Vehicle, seed: int, spread: Mapping[str, float] = SPREAD) -> dict[str, tuple[float, float]]:
    """What the tester measured of the parameters: value and standard deviation of each, off by that much."""
    rng = np.random.default_rng([seed, 0xD5])
    found = {}
    for name, share in spread.items():
        value = float(getattr(vehicle, name))
        found[name] = (float(value * (1.0 + share * rng.standard_normal())), share * value)
    return found
