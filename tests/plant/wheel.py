"""Wheel-inertia drives: a driven wheel with a force sensor at its hub, throttle and brake stepped at 15 m/s or so.

The motion is chosen and the torque follows (inverse dynamics), so nothing stiff is integrated: the tire's force Fc(t)
is a series of smoothed steps, the car's speed v its quadrature, the slip s the one at which the tire gives Fc under the
load Fz, the wheel's speed om = v (1 + s) / r, and the torque

    T = Jw om' + Fc r + frr Fz r,    hub forces  Fc - mw v'  and  Fz - mw g.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from tests.plant.information import Array, Information, effect_slopes, from_constraints, prior, total
from tests.plant.sample import Samples
from tests.plant.sensors import (
    ACCELEROMETER,
    GROUND_SPEED,
    WHEEL_FORCE,
    WHEEL_SPEED,
    WHEEL_TORQUE,
    Record,
    Sensor,
    jitter,
    read,
    regular,
)
from tests.plant.vehicle import AIR_DENSITY, GRAVITY, REFERENCE, Vehicle
from tests.plant.write_csv import csv_bytes

EFFECTS = {
    "brake_drag": "N m of rubbing brake behind the torque sensor",
    "brake_drag_fading": "N m of a brake that lets go within 15 s from the first sample on",
    "bearing_drag": "N m s/rad",
    "bearing_warmup": "N m of a cold bearing that falls with a time constant of 15 s from the first sample on",
    "wheel_windage": "N m s^2/rad^2 of air about the wheel",
    "hub_torque_gain": "1: the torque channel reads (1 + q) times the torque",
    "hub_torque_offset": "N m on the torque channel",
    "hub_torque_crosstalk": "N m on the torque channel per N of the vertical force at the hub",
    "torque_zero_drift": "N m/s by which the torque channel drifts from the start of each run",
    "clock_offset": "s by which torque and forces are read late",
    "hub_torque_delay": "s by which the torque alone is read late",
    "hub_torque_lag": "s, time constant of a low-pass filter in front of the torque channel",
    "wheel_radius": "1: the true radius is (1 + q) times the one that the tester knows",
    "wheel_mass": "kg by which the wheel is heavier than the tester knows",
    "drag_bump": "N m at 45 rad/s, 3 rad/s wide: a pad that rubs at one speed; in no catalog, for controls",
}
# Sizes at which finite differences are taken.
SMALL = dict.fromkeys(EFFECTS, 1e-4) | {
    "brake_drag": 1.0,
    "brake_drag_fading": 1.0,
    "bearing_warmup": 1.0,
    "wheel_windage": 1e-5,
    "hub_torque_offset": 1.0,
    "torque_zero_drift": 0.01,
    "hub_torque_lag": 1e-3,
    "wheel_mass": 0.1,
    "drag_bump": 1.0,
}
ONE_SIDED = ("hub_torque_lag",)
RATE = 200.0
FINE = 5e-4  # s, grid of the truth
LAG = 0.07  # s, of brake and throttle, twice in a row
SHARE = 0.4  # of the car's longitudinal force that this wheel carries
SENSORS: dict[str, Sensor] = {
    "Hub Torque [N m]": WHEEL_TORQUE,
    "Wheel Speed [rad/s]": WHEEL_SPEED.but(step=0.01),
    "Hub Fx [N]": WHEEL_FORCE,
    "Hub Fz [N]": WHEEL_FORCE,
    "Accel [m/s^2]": ACCELEROMETER,
    "Speed [km/h]": GROUND_SPEED,
}
LATE = ("Hub Torque [N m]", "Hub Fx [N]", "Hub Fz [N]")
DECIMALS = {"Time [s]": 5, "Hub Torque [N m]": 1, "Wheel Speed [rad/s]": 2, "Hub Fx [N]": 0, "Hub Fz [N]": 0,
            "Speed [km/h]": 2}  # fmt: skip


@dataclass(frozen=True)
class Drive:
    """One run as driven: levels of acceleration wanted (m/s^2) from given times on, and the road's humps."""

    times: Array
    speed: float
    switch: Array
    level: Array
    humps: Array  # (3, k): amplitude (share of the load), frequency (1/s), phase


def truth(vehicle: Vehicle) -> dict[str, float]:
    return {"wheel_inertia": vehicle.wheel_inertia}


def known(vehicle: Vehicle) -> dict[str, float]:
    """What the tester writes into the description, whatever is hidden."""
    return {name: float(getattr(vehicle, name)) for name in ("wheel_mass", "wheel_radius", "rolling_resistance")}


def drives(seed: int, count: int = 3, duration: float = 30.0) -> list[Drive]:
    """Accelerate, roll, brake, roll, again and again, each time harder or softer, the speed gained being given back."""
    rng = np.random.default_rng([seed, 0x33])
    result = []
    for _ in range(count):
        switch, level, now = [0.0], [0.0], float(rng.uniform(0.5, 1.0))
        while now < duration:
            gain, harder, softer = rng.uniform(5.0, 8.0), rng.uniform(2.2, 3.4), rng.uniform(2.2, 3.4)
            for wanted in (harder, -softer):
                switch += [now, now + gain / abs(wanted)]
                level += [wanted, 0.0]
                now = switch[-1] + rng.uniform(0.4, 0.9)
        humps = np.array([rng.uniform(0.005, 0.015, 6), rng.uniform(0.3, 3.0, 6), rng.uniform(0.0, 2 * np.pi, 6)])
        speed = float(rng.uniform(10.0, 15.0))
        times = jitter(regular(duration, RATE), 0.1, rng)
        result.append(Drive(times, speed, np.array(switch), np.array(level), humps))
    return result


def noise_free(vehicle: Vehicle, drive: Drive, effects: Mapping[str, float] | None = None) -> dict[str, Array]:
    """What perfect sensors would log, SI, by column header."""
    effects = effects or {}
    unknown = set(effects) - set(EFFECTS)
    if unknown:
        raise ValueError(f"a wheel-inertia drive has no effect {sorted(unknown)}")
    radius = vehicle.wheel_radius * (1.0 + effects.get("wheel_radius", 0.0))
    heavy = vehicle.wheel_mass + effects.get("wheel_mass", 0.0)
    clock = FINE * np.arange(int(drive.times[-1] / FINE) + 3)
    force = SHARE * vehicle.mass * _smoothed(drive, clock)
    speed, acceleration = _motion(vehicle, force / SHARE, drive.speed, clock)
    load = _load(vehicle, drive, acceleration, clock)
    turning = speed * (1.0 + _slip(vehicle, force / load)) / radius
    torque = vehicle.wheel_inertia * np.gradient(turning, FINE, edge_order=2)
    torque += force * radius + vehicle.rolling_resistance * load * radius
    torque += effects.get("brake_drag", 0.0) + effects.get("bearing_drag", 0.0) * turning
    fading = effects.get("brake_drag_fading", 0.0) + effects.get("bearing_warmup", 0.0)
    torque += fading * np.exp(-(clock - drive.times[0]) / 15.0)
    torque += effects.get("wheel_windage", 0.0) * turning**2
    torque += effects.get("drag_bump", 0.0) * np.exp(-0.5 * ((turning - 45.0) / 3.0) ** 2)
    torque = torque * (1.0 + effects.get("hub_torque_gain", 0.0)) + effects.get("hub_torque_offset", 0.0)
    torque += effects.get("hub_torque_crosstalk", 0.0) * (load - heavy * GRAVITY)
    torque += effects.get("torque_zero_drift", 0.0) * (clock - drive.times[0])
    if lag := effects.get("hub_torque_lag", 0.0):
        torque = _filtered(torque, lag)
    signals = (torque, turning, force - heavy * acceleration, load - heavy * GRAVITY, acceleration, speed)
    shifts = dict.fromkeys(LATE, effects.get("clock_offset", 0.0))
    shifts["Hub Torque [N m]"] += effects.get("hub_torque_delay", 0.0)
    return {
        header: np.interp(drive.times - shifts.get(header, 0.0), clock, signal)
        for header, signal in zip(SENSORS, signals, strict=True)
    }


def _filtered(signal: Array, lag: float) -> Array:
    """The signal behind a first-order low-pass filter, steady at first; linear between the points of the truth."""
    kept = np.exp(-FINE / lag)
    late = lag / FINE * (1.0 - kept)  # share of a step's rise that the filter has not followed at its end
    forced = (1.0 - kept) * signal[:-1] + (1.0 - late) * np.diff(signal)
    read = np.empty_like(signal)
    read[0] = signal[0]
    for k, value in enumerate(forced):
        read[k + 1] = kept * read[k] + value
    return read


def campaign(
    vehicle: Vehicle, seed: int, effects: Mapping[str, float] | None = None, count: int = 3, duration: float = 30.0
) -> list[Record]:
    """The logs of ``count`` runs, noise and all."""
    rng = np.random.default_rng([seed, 0x34])
    records = []
    for drive in drives(seed, count, duration):
        columns = {"Time [s]": drive.times}
        for header, true in noise_free(vehicle, drive, effects).items():
            columns[header] = read(SENSORS[header], true, rng) * (3.6 if header == "Speed [km/h]" else 1.0)
        records.append(Record(columns, DECIMALS))
    return records


def information(
    vehicle: Vehicle,
    seed: int,
    effects: Mapping[str, float] | None = None,
    count: int = 3,
    duration: float = 30.0,
    unknowns: Sequence[str] = (),
) -> Information:
    """About the wheel's inertia, the effects in ``unknowns``, and each run's torque zero (all sensors' zeros at the
    torque, within data sheets).

    The motion itself is unknown: over each sampling interval Jw times the change of speed equals the mean of the
    torques at its ends, and every one of those readings is noisy.
    """
    r, J = vehicle.wheel_radius, vehicle.wheel_inertia
    levers = {"Hub Torque [N m]": 1.0, "Hub Fx [N]": r, "Hub Fz [N]": vehicle.rolling_resistance * r,
              "Accel [m/s^2]": vehicle.wheel_mass * r}  # fmt: skip
    noise = sum((lever * _sd(SENSORS[header])) ** 2 for header, lever in levers.items())
    zero = sum((lever * SENSORS[header].zero) ** 2 for header, lever in levers.items()) ** 0.5
    parts = []
    for k, drive in enumerate(drives(seed, count, duration)):
        turning = noise_free(vehicle, drive, effects)["Wheel Speed [rad/s]"]
        dt = np.diff(drive.times)
        by_effect = effect_slopes(partial(_imbalance, vehicle, drive), effects or {}, unknowns, SMALL, ONE_SIDED)
        by_unknown = np.column_stack([np.diff(turning), dt, by_effect])
        spread = (J * _sd(SENSORS["Wheel Speed [rad/s]"])) ** 2
        band = np.zeros((2, dt.size))
        band[0] = 2 * spread + dt**2 / 2 * noise
        band[1, :-1] = -spread + dt[1:] * dt[:-1] / 4 * noise
        names = ("wheel_inertia", f"zero_{k}", *unknowns)
        parts += [from_constraints(names, by_unknown, band), prior({f"zero_{k}": zero})]
    return total(parts)


def _imbalance(vehicle: Vehicle, drive: Drive, effects: Mapping[str, float]) -> Array:
    """By how much the torques read miss the change of spin over each sampling interval when effects are ignored."""
    torque, turning, force, load, acceleration, _ = noise_free(vehicle, drive, effects).values()
    force = force + vehicle.wheel_mass * acceleration
    load = load + vehicle.wheel_mass * GRAVITY
    net = torque - (force + vehicle.rolling_resistance * load) * vehicle.wheel_radius
    pushed = (net[1:] + net[:-1]) / 2 * np.diff(drive.times)
    return np.asarray(pushed - vehicle.wheel_inertia * np.diff(turning))


def samples() -> Samples:
    logs = campaign(REFERENCE, seed=2017)
    return Samples(
        title="Wheel-inertia drives",
        files={f"wheel_{k}.csv": csv_bytes(log) for k, log in enumerate(logs, start=1)},
        truth=truth(REFERENCE),
        about=(
            "Throttle and brake steps; the force sensor sits between the wheel and everything inboard, brake included, "
            f"and carries {REFERENCE.wheel_mass} kg of wheel, whose weight its loads do not contain. The "
            "accelerometer is the car's."
        ),
    )


def _sd(sensor: Sensor) -> float:
    return float(np.hypot(sensor.noise, sensor.step / 12**0.5))


def _smoothed(drive: Drive, clock: Array) -> Array:
    """The wanted levels behind two equal first-order lags: each step is 1 - (1 + u) exp(-u), u = time since / lag."""
    steps = np.diff(drive.level, prepend=0.0)
    wanted = np.zeros_like(clock)
    for when, step in zip(drive.switch, steps, strict=True):
        u = np.maximum(clock - when, 0.0) / LAG
        wanted += step * (1.0 - (1.0 + u) * np.exp(-u))
    return wanted


def _motion(vehicle: Vehicle, force: Array, start: float, clock: Array) -> tuple[Array, Array]:
    """Speed and acceleration of the car under ``force``, air drag and rolling resistance: Picard's iteration."""
    drag = AIR_DENSITY / 2 * vehicle.drag_area
    speed = np.full_like(clock, start)
    acceleration = np.zeros_like(clock)
    for _ in range(12):
        acceleration = (force - drag * speed**2) / vehicle.mass - vehicle.rolling_resistance * GRAVITY
        rise = (acceleration[1:] + acceleration[:-1]) / 2 * np.diff(clock)
        speed = start + np.concatenate([[0.0], np.cumsum(rise)])
    return speed, acceleration


def _load(vehicle: Vehicle, drive: Drive, acceleration: Array, clock: Array) -> Array:
    """The front wheel's share of weight, less what acceleration shifts to the rear, and humps of the road."""
    shift = vehicle.mass * vehicle.cg_height / vehicle.wheelbase * acceleration
    size, frequency, phase = drive.humps
    humps = np.sin(2 * np.pi * np.outer(clock, frequency) + phase) @ size
    return (vehicle.front_load * (1.0 + humps) - shift) / 2


def _slip(vehicle: Vehicle, friction: Array) -> Array:
    """The slip below the peak at which the tire gives ``friction`` = Fc / Fz: Newton on the inner function."""
    inner = np.tan(np.arcsin(friction / vehicle.tire_D) / vehicle.tire_C)
    x = inner.copy()
    for _ in range(20):
        x -= ((1 - vehicle.tire_E) * x + vehicle.tire_E * np.arctan(x) - inner) / (
            (1 - vehicle.tire_E) + vehicle.tire_E / (1 + x**2)
        )
    return np.asarray(x / vehicle.tire_B)
