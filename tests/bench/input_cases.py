"""Test days whose channels are not those of the other cases: constants, wheel speed, motor current, a free wheel ..."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.bench.cases import COAST_CHANNELS, Case, Made, write
from tests.plant import coast
from tests.plant.coast_information import information as coast_information
from tests.plant.information import prior, total
from tests.plant.sensors import Record, quantize, white
from tests.plant.vehicle import random_vehicle

RADIUS_SD = 0.003  # relative, of a rolling radius that was measured by rolling ten turns
WHEEL_SPEED_SD, WHEEL_SPEED_STEP = 0.3, 0.1  # rpm, of a wheel speed from the CAN bus
CONSTANT_SD = 0.01  # relative, of a motor's torque constant by its data sheet
CURRENT_SD, CURRENT_STEP = 0.3, 0.05  # A
GRADE = 0.004  # of a test hill of constant slope
RPM = 30.0 / np.pi


def coasts(
    known: Mapping[str, Any],
    folder: Path,
    runs: Sequence[coast.Run],
    channels: Mapping[str, tuple[str, str] | Mapping[str, Any]],
    **settings: Any,
) -> Path:
    """A coast-down's description with its runs; ``channels`` beside the clock."""
    notes = [{"direction": run.direction, "start": run.start} for run in runs]
    mapped = {"time": COAST_CHANNELS["time"], "position": COAST_CHANNELS["position"], **channels}
    return write(folder, "coastdown", known, mapped, [run.record for run in runs], notes, settings=settings)


def with_column(run: coast.Run, header: str, values: np.ndarray, without: str) -> coast.Run:
    """The run with a column in the place of another one."""
    columns = {n: v for n, v in run.record.columns.items() if n != without}
    return replace(run, record=Record({**columns, header: values}, run.record.decimals))


def _constant_grade(seed: int, folder: Path) -> Made:
    """Coasts down one hill, whose slope is known and was not logged."""
    vehicle, day = random_vehicle(seed), coast.DAY.but(one_way=True)
    runs = coast.campaign(vehicle, seed, day, {"road_grade": GRADE})
    fixed = {"drag_coefficient": vehicle.drag_coefficient}
    grade = {"constant": f"{100 * GRADE} %"}
    channels = {"speed": COAST_CHANNELS["speed"], "grade": grade}
    path = coasts(coast.known(vehicle, day), folder, runs, channels, fix=fixed)  # type: ignore[arg-type]
    bound = coast_information(vehicle, seed, day, {"road_grade": GRADE}).known(["drag_area"]).bound()
    return Made(path, {"rolling_resistance": vehicle.rolling_resistance}, bound)


def _wheel_speed(seed: int, folder: Path) -> Made:
    """Coasts of which only a wheel's speed was logged, its radius known within 0.3 %."""
    vehicle, rng = random_vehicle(seed), np.random.default_rng([seed, 0x35])
    day = coast.WIDE.but(speed=coast.DAY.speed.but(noise=0.0, step=0.0, latency=0.0))
    runs = []
    for run in coast.campaign(vehicle, seed, day):
        turns = run.record["GPS Speed [km/h]"] / 3.6 / vehicle.wheel_radius * RPM
        read = quantize(white(turns, WHEEL_SPEED_SD, rng), WHEEL_SPEED_STEP)
        runs.append(with_column(run, "Wheel FL [1/min]", read, "GPS Speed [km/h]"))
    measured = float(vehicle.wheel_radius * (1.0 + RADIUS_SD * rng.standard_normal()))
    stated = {**coast.known(vehicle, day), "wheel_radius": f"{measured!r} +- {RADIUS_SD * measured!r} m"}
    path = coasts(stated, folder, runs, {"wheel_speed": ("Wheel FL [1/min]", "1/min")})
    noise = np.hypot(WHEEL_SPEED_SD, WHEEL_SPEED_STEP / 12**0.5) / RPM * vehicle.wheel_radius
    seen = day.but(speed=day.speed.but(noise=float(noise)))
    information = coast_information(vehicle, seed, seen, unknowns=["speed_scale"])
    bound = total([information, prior({"speed_scale": RADIUS_SD})]).bound()
    return Made(path, coast.truth(vehicle), bound)


def _motor_current(seed: int, folder: Path) -> Made:
    """Drives whose torque is the current of the motor times a constant known within 1 %."""
    vehicle, rng = random_vehicle(seed), np.random.default_rng([seed, 0x36])
    day = coast.POWERED.but(torque=coast.TORQUE.but(noise=0.0, step=0.0, zero=0.0))
    true = float(rng.uniform(0.3, 0.9))  # N m/A
    runs = []
    for run in coast.campaign(vehicle, seed, day):
        read = quantize(white(run.record["Drive Torque [N m]"] / true, CURRENT_SD, rng), CURRENT_STEP)
        runs.append(with_column(run, "Motor Iq [A]", read, "Drive Torque [N m]"))
    stated = float(true * (1.0 + CONSTANT_SD * rng.standard_normal()))
    known = {**coast.known(vehicle, day), "torque_constant": f"{stated!r} +- {CONSTANT_SD * stated!r} N m/A"}
    channels = {"speed": COAST_CHANNELS["speed"], "motor_current": ("Motor Iq [A]", "A")}
    path = coasts(known, folder, runs, channels)
    seen = day.but(torque=coast.TORQUE.but(noise=CURRENT_SD * true, zero=0.0))
    information = coast_information(vehicle, seed, seen, unknowns=["torque_gain"])
    bound = total([information, prior({"torque_gain": CONSTANT_SD})]).bound()
    return Made(path, coast.truth(vehicle), bound)


INPUT_CASES: dict[str, Case] = {
    "coastdown_constant_grade": Case(
        "coastdown",
        "Eight coasts down one hill whose slope is a `constant:` channel, drag coefficient fixed.",
        _constant_grade,
    ),
    "coastdown_wheel_speed": Case(
        "coastdown",
        "Eight coasts from 36 to 2 m/s, a wheel's speed in rpm for speed, its radius known within 0.3 %.",
        _wheel_speed,
    ),
    "coastdown_motor_current": Case(
        "coastdown",
        "Eight drives with the motor's current for torque, its torque constant known within 1 %.",
        _motor_current,
    ),
}
