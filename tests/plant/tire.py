"""Slip sweeps: one wheel of a car that is towed at constant speed is driven and braked slowly through its slip range.

Both speeds are noisy, so slip is; the tire's force is Fz times the magic formula, as a function of the true slip.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from tests.plant.information import Array, Information, effect_slopes, slopes, total
from tests.plant.sample import Samples
from tests.plant.sensors import GROUND_SPEED, WHEEL_FORCE, WHEEL_SPEED, Record, Sensor, jitter, read, regular
from tests.plant.vehicle import REFERENCE, Vehicle
from tests.plant.write_csv import csv_bytes

EFFECTS = {
    "load_sensitivity": "1/N: friction falls by this share per newton above the static front wheel load",
    "slip_offset": "1: the slip read is larger by this",
    "force_offset": "N on the force channel",
    "load_offset": "N on the load channel",
    "rolling_force": "1: rolling resistance per load, which the force channel contains at no slip",
    "vertical_shift": "1: friction that is there at no slip, as a tire with ply steer or a conical tread has; an input",
    "stiffness_load": "1/N: slip stiffness per load falls by this share per newton above the static load, not its peak",
    "tire_relaxation": "m over which slip builds up",
    "friction_fade": "s/m: friction is lost with the sliding speed |vs|, mu (1 - q |vs|)",
    "braking_friction": "1: friction is (1 + q) times as high under braking",
    "vertical_crosstalk": "1: share of the tire's force that the load channel reads",
}
# Sizes at which finite differences are taken.
SMALL = {
    "load_sensitivity": 1e-6,
    "slip_offset": 1e-5,
    "force_offset": 1.0,
    "load_offset": 1.0,
    "vertical_shift": 1e-4,
    "rolling_force": 1e-4,
    "tire_relaxation": 0.2,
}
SMALL |= {"friction_fade": 1e-4, "braking_friction": 1e-3, "vertical_crosstalk": 1e-4, "stiffness_load": 1e-6}
ONE_SIDED = ("tire_relaxation",)
PARAMETERS = ("tire_B", "tire_C", "tire_D", "tire_E")
RATE = 100.0
SENSORS: dict[str, Sensor] = {
    "Wheel Speed [rad/s]": WHEEL_SPEED.but(noise=0.25),  # a tire that vibrates, a tooth wheel at 100 Hz
    "Vehicle Speed [km/h]": GROUND_SPEED.but(noise=0.10),
    "Fx [N]": WHEEL_FORCE.but(noise=30.0, zero=0.0),
    "Fz [N]": WHEEL_FORCE.but(noise=30.0, zero=0.0),
}
DECIMALS = {"Wheel Speed [rad/s]": 3, "Vehicle Speed [km/h]": 2, "Fx [N]": 0, "Fz [N]": 0}


@dataclass(frozen=True)
class Sweep:
    """One run as driven: speed, load and slip over time."""

    times: Array
    speed: Array
    load: Array
    slip: Array


def truth(vehicle: Vehicle) -> dict[str, float]:
    """``tire_longitudinal_stiffness`` is B C D, the slope of Fx/Fz over slip."""
    return {name: float(getattr(vehicle, name)) for name in (*PARAMETERS, "tire_longitudinal_stiffness")}


def known(vehicle: Vehicle) -> dict[str, float]:
    """What the tester writes into the description."""
    return {"wheel_radius": vehicle.wheel_radius}


def friction(slip: Array, B: Array | float, C: Array | float, D: Array | float, E: Array | float) -> Array:
    """Fx / Fz."""
    return np.asarray(D * np.sin(C * np.arctan((1 - E) * B * slip + E * np.arctan(B * slip))))


def peak_slip(vehicle: Vehicle) -> float:
    """Where the friction is largest: the inner function reaches tan(pi / 2 C)."""
    inner, e = float(np.tan(np.pi / 2 / vehicle.tire_C)), vehicle.tire_E
    return float(brentq(lambda x: (1 - e) * x + e * np.arctan(x) - inner, 0.0, 1e3)) / vehicle.tire_B


def sweeps(vehicle: Vehicle, seed: int, count: int = 5, duration: float = 12.0, peak: bool = True) -> list[Sweep]:
    """Each at its own load and speed; with ``peak`` most go to 2-4 times the peak's slip, else all stay below half."""
    rng = np.random.default_rng([seed, 0x71])
    loads = vehicle.front_load / 2 * np.linspace(0.7, 1.35, count)
    result = []
    for load in rng.permutation(loads):
        times = jitter(regular(duration, RATE), 0.1, rng)
        reach = peak_slip(vehicle) * (rng.uniform(2.0, 4.0) if peak else rng.uniform(0.35, 0.45))
        reach = min(reach, 0.6)
        speed = rng.uniform(12.0, 17.0) * (1.0 + 0.01 * np.sin(rng.uniform(0.2, 0.6) * times + rng.uniform(0.0, 6.0)))
        swell = 0.02 * np.sin(2 * np.pi * rng.uniform(0.8, 1.6) * times + rng.uniform(0.0, 6.0))
        turn = 2 * np.pi * np.clip((times - 0.5) / (duration - 1.0), 0.0, 1.0)
        result.append(Sweep(times, speed, load * (1.0 + swell), reach * np.sin(turn) ** 3))
    return result


def noise_free(vehicle: Vehicle, sweep: Sweep, effects: Mapping[str, float] | None = None) -> dict[str, Array]:
    """What perfect sensors would log, SI, by column header."""
    effects = effects or {}
    unknown = set(effects) - set(EFFECTS)
    if unknown:
        raise ValueError(f"a slip sweep has no effect {sorted(unknown)}")
    lagging = _lagged(sweep, effects.get("tire_relaxation", 0.0))
    stiffer = 1.0 - effects.get("stiffness_load", 0.0) * (sweep.load - vehicle.front_load / 2)
    grip = friction(lagging, vehicle.tire_B * stiffer, vehicle.tire_C, vehicle.tire_D, vehicle.tire_E)
    grip *= 1.0 - effects.get("load_sensitivity", 0.0) * (sweep.load - vehicle.front_load / 2)
    grip *= 1.0 - effects.get("friction_fade", 0.0) * np.abs(sweep.slip * sweep.speed)
    grip *= 1.0 + effects.get("braking_friction", 0.0) * (lagging < 0.0)
    grip += effects.get("vertical_shift", 0.0)
    turning = sweep.speed * (1.0 + sweep.slip + effects.get("slip_offset", 0.0)) / vehicle.wheel_radius
    grip -= effects.get("rolling_force", 0.0)
    force = grip * sweep.load + effects.get("force_offset", 0.0)
    load = sweep.load * (1.0 + effects.get("vertical_crosstalk", 0.0) * grip) + effects.get("load_offset", 0.0)
    return dict(zip(SENSORS, (turning, sweep.speed, force, load), strict=True))


def campaign(
    vehicle: Vehicle,
    seed: int,
    effects: Mapping[str, float] | None = None,
    count: int = 5,
    duration: float = 12.0,
    peak: bool = True,
) -> list[Record]:
    """The logs of ``count`` sweeps, noise and all."""
    rng = np.random.default_rng([seed, 0x72])
    records = []
    for sweep in sweeps(vehicle, seed, count, duration, peak):
        columns = {"Time [s]": sweep.times}
        for header, true in noise_free(vehicle, sweep, effects).items():
            columns[header] = read(SENSORS[header], true, rng) * (3.6 if "km/h" in header else 1.0)
        records.append(Record(columns, {"Time [s]": 4, **DECIMALS}))
    return records


def information(
    vehicle: Vehicle,
    seed: int,
    effects: Mapping[str, float] | None = None,
    count: int = 5,
    duration: float = 12.0,
    peak: bool = True,
    unknowns: Sequence[str] = (),
) -> Information:
    """About B, C, D, E and the effects in ``unknowns`` when each sample's true speeds and load are unknown: their
    errors count with the force's."""
    at = np.array([getattr(vehicle, name) for name in PARAMETERS])
    parts = []
    noise = {header: np.hypot(s.noise, s.step / 12**0.5) for header, s in SENSORS.items()}
    for sweep in sweeps(vehicle, seed, count, duration, peak):
        clean = noise_free(vehicle, sweep, effects)

        def force(batch: Array, sweep: Sweep = sweep) -> Array:
            return friction(sweep.slip, *(column[:, None] for column in batch.T)) * sweep.load

        def read_force(batch: Array, log: dict[str, Array] = clean) -> Array:
            turning, speed, _, load = (
                log[h] + shift[:, None] for h, shift in zip(SENSORS, np.insert(batch, 2, 0.0, axis=1).T, strict=True)
            )
            slip = turning * vehicle.wheel_radius / speed - 1.0
            return np.asarray(friction(slip, *at) * load)

        def beyond(hidden: Mapping[str, float], sweep: Sweep = sweep) -> Array:
            turning, speed, pull, load = noise_free(vehicle, sweep, hidden).values()
            return np.asarray(pull - friction(turning * vehicle.wheel_radius / speed - 1.0, *at) * load)

        by_reading = slopes(read_force, np.zeros(3), np.array([1e-4, 1e-4, 1.0]))
        sd = np.array([noise["Wheel Speed [rad/s]"], noise["Vehicle Speed [km/h]"], noise["Fz [N]"]])
        variance = noise["Fx [N]"] ** 2 + np.sum((by_reading * sd) ** 2, axis=1)
        by_effect = effect_slopes(beyond, effects or {}, unknowns, SMALL, ONE_SIDED)
        whitened = np.hstack([slopes(force, at, np.full(4, 1e-4)), by_effect]) / np.sqrt(variance)[:, None]
        parts.append(Information((*PARAMETERS, *unknowns), whitened.T @ whitened))
    return total(parts)


def stiffness_bound(vehicle: Vehicle, info: Information) -> float:
    """Least standard deviation of B C D."""
    slope = np.array([getattr(vehicle, name) for name in PARAMETERS])
    slope = np.append(vehicle.tire_longitudinal_stiffness / slope[:3], 0.0)
    return float(np.sqrt(slope @ np.linalg.solve(info.matrix, slope)))


def samples() -> Samples:
    logs = campaign(REFERENCE, seed=2017)
    return Samples(
        title="Slip sweeps",
        files={f"slip_{k}.csv": csv_bytes(log) for k, log in enumerate(logs, start=1)},
        truth=truth(REFERENCE),
        about="One wheel driven and braked through its slip at constant speed, each sweep at another load.",
    )


def _lagged(sweep: Sweep, length: float) -> Array:
    """Slip behind its build-up length: exact between samples for a slip that goes straight from one to the next."""
    if length == 0.0:
        return sweep.slip
    fine = np.linspace(sweep.times[0], sweep.times[-1], 20 * sweep.times.size)
    wanted = np.interp(fine, sweep.times, sweep.slip)
    rate = np.interp(fine, sweep.times, sweep.speed) / length
    step = fine[1] - fine[0]
    slope = np.diff(wanted) / step
    slip = np.empty_like(wanted)
    slip[0] = wanted[0]
    for k, (target, rise, r) in enumerate(zip(wanted[:-1], slope, rate[:-1], strict=True)):
        gone = np.exp(-r * step)
        slip[k + 1] = gone * (slip[k] - target + rise / r) + target + rise * step - rise / r
    return np.interp(sweep.times, fine, slip)
