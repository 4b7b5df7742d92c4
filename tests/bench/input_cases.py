"""Test days whose channels are not those of the other cases: constants, wheel speed, motor current, a free wheel ..."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tests.bench.cases import COAST_CHANNELS, Case, Made, tire_sweeps, write
from tests.plant import coast, drop, shaft, stand, tire
from tests.plant.coast_information import information as coast_information
from tests.plant.information import prior, total
from tests.plant.sensors import Record, Sensor, quantize, white
from tests.plant.vehicle import random_vehicle

RADIUS_SD = 0.003  # relative, of a rolling radius that was measured by rolling ten turns
WHEEL_SPEED_SD, WHEEL_SPEED_STEP = 0.3, 0.1  # rpm, of a wheel speed from the CAN bus
CONSTANT_SD = 0.01  # relative, of a motor's torque constant by its data sheet
CURRENT_SD, CURRENT_STEP = 0.3, 0.05  # A
GRADE = 0.004  # of a test hill of constant slope
GEAR = 9.7  # turns of the motor per turn of the wheel
ENCODER_STEP, ENCODER_SD = 2 * np.pi / 65536, 2e-5  # rad
SHAPE_SD = {"tire_C": 0.05, "tire_E": 0.1}  # of a tire of the same make on another rig
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


def _tire(
    seed: int, folder: Path, effects: Mapping[str, float], settings: Mapping[str, Any], peak: bool = True
) -> Made:
    """Slip sweeps whose curve has more unknowns; the truth and the bound of the usual ones."""
    vehicle = random_vehicle(seed)
    path = tire_sweeps(vehicle, seed, folder, peak, effects)
    description = yaml.safe_load(path.read_text(encoding="utf-8"))
    path.write_text(yaml.safe_dump({**description, "settings": dict(settings)}), encoding="utf-8")
    info = tire.information(vehicle, seed, effects, peak=peak, unknowns=tuple(effects))
    truth = {n: tire.truth(vehicle)[n] for n in tire.PARAMETERS}
    return Made(path, truth, info.bound())


def _tire_shifts(seed: int, folder: Path) -> Made:
    """Curves that are shifted by some percent of slip and of friction."""
    rng = np.random.default_rng([seed, 0x37])
    shifts = {"slip_offset": float(rng.normal(0, 0.01)), "vertical_shift": float(rng.normal(0, 0.02))}
    made = _tire(seed, folder, shifts, {"shifts": True})
    truth = {**made.truth, "tire_Sh": -shifts["slip_offset"], "tire_Sv": shifts["vertical_shift"]}
    bound = {**made.bound, "tire_Sh": made.bound["slip_offset"], "tire_Sv": made.bound["vertical_shift"]}
    return Made(made.description, truth, bound)


def _tire_two_peaks(seed: int, folder: Path) -> Made:
    """Tires that grip better or worse in braking."""
    more = float(np.random.default_rng([seed, 0x38]).uniform(-0.15, 0.15))
    made = _tire(seed, folder, {"braking_friction": more}, {"peaks": "two"})
    peak = made.truth["tire_D"]
    bound = float(np.hypot((1 + more) * made.bound["tire_D"], peak * made.bound["braking_friction"]))
    return Made(
        made.description, {**made.truth, "tire_D_brake": peak * (1 + more)}, {**made.bound, "tire_D_brake": bound}
    )


def _tire_priors(seed: int, folder: Path) -> Made:
    """Sweeps that end before the peak, C and E known from another test."""
    vehicle, rng = random_vehicle(seed), np.random.default_rng([seed, 0x39])
    known = {n: float(rng.normal(getattr(vehicle, n), sd)) for n, sd in SHAPE_SD.items()}
    priors = {n: f"{known[n]!r} +- {sd}" for n, sd in SHAPE_SD.items()}
    made = _tire(seed, folder, {}, {"priors": priors}, peak=False)
    information = tire.information(vehicle, seed, peak=False)
    return Made(made.description, made.truth, total([information, prior(SHAPE_SD)]).bound())


def _shaft_angles(seed: int, folder: Path) -> Made:
    """A tip-in of which torque and the angles of both ends were logged, the motor's before a gear."""
    vehicle, rng = random_vehicle(seed), np.random.default_rng([seed, 0x3A])
    (record,) = shaft.campaign(vehicle, seed)
    times = record["Time [s]"]
    fine = np.arange(0.0, times[-1] + 2e-4, 1e-4)
    clean = shaft.noise_free(vehicle, fine)
    slow, twist = clean["Wheel Speed [rad/s]"], clean["Twist [deg]"]
    wheel = np.concatenate([[0.0], np.cumsum((slow[1:] + slow[:-1]) / 2 * np.diff(fine))])
    motor = GEAR * (wheel + twist)
    angles = {
        "Motor Angle [rad]": quantize(white(np.interp(times, fine, motor) + 3.0, ENCODER_SD, rng), ENCODER_STEP),
        "Wheel Angle [rad]": quantize(white(np.interp(times, fine, wheel) - 1.0, ENCODER_SD, rng), ENCODER_STEP),
    }
    columns = {n: v for n, v in record.columns.items() if n in ("Time [s]", "Shaft Torque [N m]")}
    channels = {
        "time": ("Time [s]", "s"),
        "shaft_torque": ("Shaft Torque [N m]", "N m"),
        "motor_angle": ("Motor Angle [rad]", "rad"),
        "wheel_angle": ("Wheel Angle [rad]", "rad"),
    }
    log = Record({**columns, **angles}, {**shaft.DECIMALS, **dict.fromkeys(angles, 7)})
    path = write(folder, "shaft", {}, channels, [log], [{"side": "left"}], settings={"gear_ratio": GEAR})
    one = float(np.hypot(ENCODER_SD, ENCODER_STEP / 12**0.5))
    unread = Sensor(noise=1e3)
    sensors = {**shaft.SENSORS, "Motor Speed [rad/s]": unread, "Wheel Speed [rad/s]": unread}
    sensors["Twist [deg]"] = Sensor(noise=float(np.hypot(one / GEAR, one)))
    truth = {name: shaft.truth(vehicle)[name] for name in ("shaft_stiffness_left", "shaft_damping_left")}
    return Made(path, truth, shaft.information(vehicle, seed, sensors=sensors).bound())


SPIN_CHANNELS = {"time": ("Time [s]", "s"), "wheel_speed": ("Wheel Speed [rad/s]", "rad/s")}


def _stand(seed: int, folder: Path) -> Made:
    """A wheel spun up and down on a stand, with a torque sensor."""
    vehicle = random_vehicle(seed)
    channels = {**SPIN_CHANNELS, "hub_torque": ("Torque [N m]", "N m")}
    settings = {"torque_zero": stand.TORQUE.zero, "gain_std": 0.0}  # the gain is exact, as the bound assumes
    records = stand.campaign(vehicle, seed)
    path = write(folder, "inertia", {}, channels, records, manoeuvre="stand", settings=settings)
    return Made(path, stand.truth(vehicle, seed), stand.information(vehicle, seed).bound())


def _stand_current(seed: int, folder: Path) -> Made:
    """The same, spun by a geared motor whose current was logged, its torque constant known within 1 %."""
    vehicle, rng = random_vehicle(seed), np.random.default_rng([seed, 0x3B])
    ratio, true = 5.0, float(rng.uniform(0.05, 0.2))
    spread = (stand.TORQUE.noise / (true * ratio) / 3, 0.01)
    records = stand.with_current(stand.campaign(vehicle, seed), true * ratio, spread, rng)
    stated = float(true * (1.0 + CONSTANT_SD * rng.standard_normal()))
    known = {"torque_constant": f"{stated!r} +- {CONSTANT_SD * stated!r} N m/A", "gear_ratio": ratio}
    channels = {**SPIN_CHANNELS, "motor_current": ("Motor Current [A]", "A")}
    settings = {"torque_zero": stand.TORQUE.zero}
    path = write(folder, "inertia", known, channels, records, manoeuvre="stand", settings=settings)
    information = stand.information(vehicle, seed, ("torque_gain",))
    return Made(path, stand.truth(vehicle, seed), total([information, prior({"torque_gain": CONSTANT_SD})]).bound())


def drops(rig: drop.Rig, seed: int, folder: Path, count: int = 3) -> Path:
    """Drops of a rig, and their description."""
    channels: dict[str, tuple[str, str]] = {"time": ("Time [s]", "s")}
    for end in rig.axles:
        channels[f"body_height_{end}"] = (f"Body {end} [m]", "m")
        channels[f"wheel_height_{end}"] = (f"Wheel {end} [m]", "m")
    kind = {"rig": "half_car" if len(rig.axles) == 2 else "quarter_car"}
    records = drop.campaign(rig, seed, count)
    return write(folder, "bump", rig.known(), channels, records, manoeuvre="drop", drop=kind)


def _drops(seed: int, folder: Path, axles: int) -> Made:
    rig = drop.random_rig(seed, axles)
    return Made(drops(rig, seed, folder), rig.truth(), drop.information(rig, seed).bound())


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
    "inertia_stand": Case("inertia", "A wheel spun up and down on a stand three times, with a torque sensor.", _stand),
    "inertia_stand_current": Case(
        "inertia",
        "The same with the current of a geared motor, its torque constant known within 1 %.",
        _stand_current,
    ),
    "bump_drop_quarter": Case(
        "bump",
        "Three drops of a quarter car from 25 to 50 mm, heights of body and wheel within 0.1 mm.",
        lambda seed, folder: _drops(seed, folder, 1),
    ),
    "bump_drop_half": Case(
        "bump",
        "Three drops of a half car, heights of body and wheel over both axles.",
        lambda seed, folder: _drops(seed, folder, 2),
    ),
    "shaft_angles": Case(
        "shaft",
        "One tip-in with the angles of two 16 bit encoders, one of them before a gear, for the twist.",
        _shaft_angles,
    ),
    "tire_shifts": Case("tire", "Five slip sweeps, shifts Sh and Sv unknown (`shifts: true`).", _tire_shifts),
    "tire_two_peaks": Case(
        "tire",
        "Five slip sweeps, friction in braking up to 15 % apart from that in driving (`peaks: two`).",
        _tire_two_peaks,
    ),
    "tire_priors": Case(
        "tire",
        "Five sweeps below half the peak, with priors C +- 0.05 and E +- 0.1 (`priors`).",
        _tire_priors,
    ),
    "coastdown_motor_current": Case(
        "coastdown",
        "Eight drives with the motor's current for torque, its torque constant known within 1 %.",
        _motor_current,
    ),
}
