"""Drives for validation, from rest to rest: accelerate, cruise, tip in and back out, coast, brake, stand.

``drive_motion`` has the equations and the effects that can be hidden; here are the driver, the sensors and the logs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from tests.plant import sample, sensors
from tests.plant.drive_motion import GUST_STEP, TOLERANCE, Drive, Pedals, Trip
from tests.plant.sample import Samples
from tests.plant.sensors import Array, Record, Sensor
from tests.plant.vehicle import AIR_DENSITY, GRAVITY, REFERENCE, Vehicle
from tests.plant.wind import Wind, gusts
from tests.plant.write_csv import CONTINENTAL, PLAIN, csv_bytes

RATE = 100.0  # Hz
WHEELS = ("FL", "FR", "RL", "RR")
TORQUE = Sensor(noise=1.0, step=0.1, zero=0.2, limit=4_000.0)
BRAKE = Sensor(noise=2.0, step=0.1, limit=20_000.0)
SPEED = sensors.GROUND_SPEED
GUSTY = Wind()


@dataclass(frozen=True)
class Rig:
    """How the drives are measured, and in what wind."""

    jitter: float = 0.02  # share of the sample spacing; one device samples all channels
    air_density: float = AIR_DENSITY
    temperature: float = 20.0  # degC; 12 to 28 from drive to drive under temperature_rolling
    wind: Wind = GUSTY
    torque: Sensor = TORQUE
    brake: Sensor = BRAKE
    speed: Sensor = SPEED
    wheel_speed: Sensor = sensors.WHEEL_SPEED
    shaft_torque: Sensor = sensors.SHAFT_TORQUE
    acceleration: Sensor = sensors.ACCELEROMETER


RIG = Rig()


@dataclass(frozen=True)
class Run:
    """One drive as handed to the tester."""

    record: Record
    direction: str
    temperature: float


@dataclass
class Driver:
    """Presses pedals in turn and keeps a rough account of the speed that a point mass would reach."""

    vehicle: Vehicle
    speed: float = 0.0
    knots: list[float] = field(default_factory=lambda: [0.0])
    drive: list[float] = field(default_factory=lambda: [0.0])
    brake: list[float] = field(default_factory=lambda: [0.0])

    def road_load(self) -> float:
        car = self.vehicle
        return car.rolling_resistance * car.mass * GRAVITY + 0.5 * AIR_DENSITY * car.drag_area * self.speed**2

    def cruising(self) -> float:
        """Torque that holds the speed."""
        return self.road_load() * self.vehicle.wheel_radius / self.vehicle.gear_ratio

    def press(self, drive: float, brake: float, ramp: float, hold: float, until: float | None = None) -> None:
        """Ramp to these torques and hold them for a time, or until a speed is reached."""
        car, spent, dt = self.vehicle, 0.0, 0.05
        start_drive, start_brake = self.drive[-1], self.brake[-1]
        before = self.speed
        while spent < ramp + hold if until is None else (self.speed - until) * (before - until) > 0 and spent < 120.0:
            w = min(spent / ramp, 1.0)
            driven = (start_drive + w * (drive - start_drive)) * car.gear_ratio
            braked = start_brake + w * (brake - start_brake)
            force = (driven - braked) / car.wheel_radius - (self.road_load() if self.speed > 0 or driven else 0.0)
            self.speed = max(0.0, self.speed + dt * force / (car.mass + car.rotating_mass))
            spent += dt
        end = self.knots[-1] + max(spent, ramp + dt)
        self.knots += [self.knots[-1] + ramp, end]
        self.drive += [drive, drive]
        self.brake += [brake, brake]

    def pedals(self, uphill: float) -> Pedals:
        return Pedals(
            tuple(np.round(self.knots, 3).tolist()),
            tuple(np.round(self.drive, 1).tolist()),
            tuple(np.round(self.brake, 1).tolist()),
            uphill,
        )


def pedals(vehicle: Vehicle, seed: int, count: int = 3) -> list[Pedals]:
    """What the driver does in each drive: 0 to 90 km/h and back to rest; tip-ins differ from drive to drive."""
    rng = np.random.default_rng([seed, 0xD1])
    result = []
    # Torque by the force it makes at the road per kg of car, so that every vehicle is driven alike.
    per_force = vehicle.mass * vehicle.wheel_radius / vehicle.gear_ratio
    for k in range(count):
        driver = Driver(vehicle)
        hold = 1500.0 * vehicle.mass / REFERENCE.mass
        driver.press(0.0, hold, 0.3, 1.2)
        driver.press(0.0, 0.0, 0.3, 0.5)
        driver.press(rng.uniform(1.8, 2.5) * per_force, 0.0, rng.uniform(0.15, 0.4), 0.0, until=40 / 3.6)
        for _ in range(2):
            driver.press(0.0, 0.0, rng.uniform(0.1, 0.2), rng.uniform(0.6, 1.2))
            driver.press(rng.uniform(1.2, 1.8) * per_force, 0.0, rng.uniform(0.1, 0.25), rng.uniform(1.0, 2.0))
        driver.press(rng.uniform(1.1, 1.5) * per_force, 0.0, 0.3, 0.0, until=90 / 3.6)
        driver.press(driver.cruising(), 0.0, 0.5, rng.uniform(8.0, 12.0))
        driver.press(0.0, 0.0, 0.3, rng.uniform(10.0, 14.0))
        if k % 3 == 2:
            driver.press(0.0, rng.uniform(2.0, 2.5) * vehicle.mass * vehicle.wheel_radius, 0.3, 0.0, until=45 / 3.6)
            driver.press(0.0, 0.0, 0.3, 0.5)
            driver.press(rng.uniform(1.2, 1.8) * per_force, 0.0, 0.2, 0.0, until=70 / 3.6)
            driver.press(0.0, 0.0, 0.2, rng.uniform(3.0, 5.0))
        driver.press(0.0, rng.uniform(1.8, 3.2) * vehicle.mass * vehicle.wheel_radius, 0.4, 0.0, until=0.5)
        driver.press(0.0, hold, 0.6, 4.0)
        result.append(driver.pedals(1.0 if k % 2 == 0 else -1.0))
    return result


def trips(
    vehicle: Vehicle,
    plans: list[Pedals],
    effects: Mapping[str, float] | None = None,
    times: list[Array] | None = None,
    tolerance: float = TOLERANCE,
    motion: type[Drive] = Drive,
) -> list[Trip]:
    """The true signals of each drive at its sample times (100 Hz where none are given)."""
    clocks = times or [sensors.regular(plan.knots[-1], RATE) for plan in plans]
    starts = [0.0 if plan.uphill > 0 else 1300.0 for plan in plans]
    return [
        motion(vehicle, plan, effects).travel(clock, start, tolerance)
        for plan, clock, start in zip(plans, clocks, starts, strict=True)
    ]


def truth(vehicle: Vehicle) -> dict[str, float]:
    """Every parameter that has a part in a drive, driveline_inertia by the plant's own name."""
    names = (
        *("mass", "wheelbase", "cg_to_rear", "cg_height", "pitch_inertia", "frontal_area", "drag_coefficient"),
        *("drag_area", "drag_height", "rolling_resistance", "rotating_mass", "suspension_stiffness_front"),
        *("suspension_stiffness_rear", "suspension_damping_front", "suspension_damping_rear", "wheel_inertia"),
        *("driveline_inertia", "wheel_radius", "gear_ratio", "tire_B", "tire_C", "tire_D", "tire_E"),
        *("tire_longitudinal_stiffness", "tire_relaxation_length", "shaft_stiffness_left", "shaft_stiffness_right"),
        *("shaft_damping_left", "shaft_damping_right"),
    )
    return {name: float(getattr(vehicle, name)) for name in names}


def noise_free(
    vehicle: Vehicle,
    plans: list[Pedals],
    effects: Mapping[str, float] | None = None,
    times: list[Array] | None = None,
    tolerance: float = TOLERANCE,
    motion: type[Drive] = Drive,
) -> list[dict[str, Array]]:
    """What perfect sensors would log, SI, by column header; sensor effects included."""
    clocks = times or [sensors.regular(plan.knots[-1], RATE) for plan in plans]
    return [
        _readings(plan, trip, clock, effects or {})
        for plan, trip, clock in zip(
            plans, trips(vehicle, plans, effects, clocks, tolerance, motion), clocks, strict=True
        )
    ]


def _readings(plan: Pedals, trip: Trip, times: Array, q: Mapping[str, float]) -> dict[str, Array]:
    late = times - q.get("torque_delay", 0.0)
    seen = times - q.get("speed_delay", 0.0)
    drive = np.interp(late, plan.knots, plan.drive)
    edge = 1e-4  # s, over which a slope is taken
    rising = (np.interp(late + edge, plan.knots, plan.drive) - np.interp(late - edge, plan.knots, plan.drive)) / edge
    drive = drive + q.get("torque_lag", 0.0) * rising / 2  # the command that the torque follows
    speed = np.interp(seen, times, trip.speed)
    columns = {
        "Time [s]": times,
        "Drive Torque [N m]": (1.0 + q.get("torque_gain", 0.0)) * drive + q.get("torque_offset", 0.0),
        "Brake Torque [N m]": np.interp(times, plan.knots, plan.brake),
        "Speed [km/h]": (1.0 + q.get("speed_scale", 0.0)) * speed,
    }
    columns |= {f"Wheel Speed {wheel} [rad/s]": trip.wheel_speed[k] for k, wheel in enumerate(WHEELS)}
    columns |= {f"Shaft Torque {side} [N m]": trip.shaft_torque[k] for k, side in enumerate(("Left", "Right"))}
    slope = np.arctan(trip.grade)
    return columns | {"Long Accel [m/s^2]": trip.acceleration + GRAVITY * np.sin(slope)}


def campaign(
    vehicle: Vehicle, seed: int, effects: Mapping[str, float] | None = None, rig: Rig = RIG, count: int = 3
) -> tuple[Run, ...]:
    """The drives as logged, from a seed."""
    return logged(vehicle, pedals(vehicle, seed, count), seed, effects, rig)


def logged(
    vehicle: Vehicle,
    pressed: list[Pedals],
    seed: int,
    effects: Mapping[str, float] | None = None,
    rig: Rig = RIG,
    motion: type[Drive] = Drive,
) -> tuple[Run, ...]:
    """Drives with these pedals as logged: gusts, mean winds, clocks and noise from a seed."""
    rng = np.random.default_rng([seed, 0xD2])
    spread = 8.0 if (effects or {}).get("temperature_rolling") else 0.0
    warm = rig.temperature + np.linspace(-spread, spread, len(pressed))
    plans = []
    for plan, temperature in zip(pressed, warm, strict=True):
        steps = int(plan.knots[-1] / GUST_STEP) + 3
        mean = rig.wind.between_runs * rng.standard_normal()
        gust = gusts(rig.wind, 1, steps, GUST_STEP, rng)[:, 0] + mean
        wind = tuple(gust.tolist())
        plans.append(replace(plan, gust=wind, temperature=float(temperature), air_density=rig.air_density))
    times = [sensors.regular(plan.knots[-1], RATE) for plan in plans]
    times = [sensors.jitter(clock, rig.jitter, rng) if rig.jitter else clock for clock in times]
    clean = noise_free(vehicle, plans, effects, times, motion=motion)
    return tuple(
        Run(_logged(true, rig, rng), "out" if plan.uphill > 0 else "back", plan.temperature)
        for plan, true in zip(plans, clean, strict=True)
    )


def _logged(true: Mapping[str, Array], rig: Rig, rng: np.random.Generator) -> Record:
    meters = {"Drive Torque": rig.torque, "Brake Torque": rig.brake, "Speed": rig.speed, "Wheel Speed": rig.wheel_speed}
    meters |= {"Shaft Torque": rig.shaft_torque, "Long Accel": rig.acceleration}
    columns = {}
    for header, values in true.items():
        meter = next((m for name, m in meters.items() if header.startswith(name)), None)
        reading = values if meter is None else sensors.read(meter, values, rng)
        columns[header] = 3.6 * reading if header.endswith("[km/h]") else reading
    decimals = {header: 1 if header.endswith("[N m]") else 3 for header in columns}
    return Record(columns, decimals | {"Time [s]": 4, "Speed [km/h]": 2})


def samples() -> Samples:
    """drive_1.csv to drive_3.csv."""
    rig = Rig(air_density=sample.AIR_DENSITY, temperature=sample.TEMPERATURE)
    runs = campaign(REFERENCE, 20172, rig=rig)
    return Samples(
        title="Drives for validation",
        files={
            f"drive_{k}.csv": csv_bytes(run.record, CONTINENTAL if k == 2 else PLAIN)
            for k, run in enumerate(runs, start=1)
        },
        truth=truth(REFERENCE) | {"air_density": sample.AIR_DENSITY},
        about=(
            "From rest to 90 km/h and back to rest on a flat road, out (1, 3) and back (2), front-wheel drive. "
            "Drive torque is that of the planetary output, before the final drive; brake torque is that of all four"
            " wheels together, from the line pressure (at rest: what the brakes could hold), 65 % of it in front. "
            "Long Accel is specific force along the road, forward positive. Every channel is on one clock; gusts "
            "and mean winds as in the coast-downs. driveline_inertia is that of the motor-generators at the driven "
            "wheels, kg m^2, before an open differential. drive_2 has semicolons and decimal commas."
        ),
    )
