"""The recovery bench's test days: one random vehicle's logs and description in a folder, the truth, and the bound.

A case writes what a tester would write; what is hidden from the program stays in ``Made``. The functions that write
logs and description also hide ``effects`` in them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import yaml

from tests.plant import bump, cg, coast, pendulum, shaft, silhouette, tire, wheel
from tests.plant.coast_information import information as coast_information
from tests.plant.sensors import Record
from tests.plant.vehicle import GRAVITY, Vehicle, random_vehicle
from tests.plant.write_csv import csv_bytes


@dataclass(frozen=True)
class Made:
    """A description on disk, and for each parameter that these logs determine its truth and Cramer-Rao bound."""

    description: Path
    truth: Mapping[str, float]
    bound: Mapping[str, float]


@dataclass(frozen=True)
class Case:
    """``make(seed, folder)`` writes one vehicle's test for ``step``."""

    step: str
    about: str
    make: Callable[[int, Path], Made]


def write(
    folder: Path,
    step: str,
    vehicle: Mapping[str, Any],
    channels: Mapping[str, tuple[str, str] | Mapping[str, Any]],
    records: Sequence[Record],
    runs: Sequence[Mapping[str, Any]] = (),
    **more: Any,
) -> Path:
    """The logs, and a description that maps ``channels`` and lists them as runs.

    ``channels`` are ours to column and unit, or to what the description says of them.
    """
    entries = []
    for k, record in enumerate(records):
        (folder / f"{step}_{k}.csv").write_bytes(csv_bytes(record))
        entries.append({"log": f"{step}_{k}.csv", **(runs[k] if runs else {})})
    description = {
        "test": step,
        "vehicle": dict(vehicle),
        "channels": {n: {"column": c[0], "unit": c[1]} if isinstance(c, tuple) else c for n, c in channels.items()},
        "runs": entries,
        **more,
    }
    path = folder / f"{step}.yaml"
    path.write_text(yaml.safe_dump(description, sort_keys=False), encoding="utf-8")
    return path


NOTHING: Mapping[str, float] = MappingProxyType({})
COAST_CHANNELS = {
    "time": ("Time [s]", "s"),
    "speed": ("GPS Speed [km/h]", "km/h"),
    "position": ("Position [m]", "m"),
}


def coast_downs(
    vehicle: Vehicle,
    seed: int,
    folder: Path,
    day: coast.Day,
    fixed: bool,
    effects: Mapping[str, float] = NOTHING,
    channels: Mapping[str, tuple[str, str]] = COAST_CHANNELS,
) -> Path:
    """A coast-down campaign, or drives with known torque."""
    runs = coast.campaign(vehicle, seed, day, effects)
    notes = [{"direction": run.direction, "start": run.start} for run in runs]
    if len({run.temperature for run in runs}) > 1:
        notes = [{**note, "temperature": f"{run.temperature:.1f} degC"} for note, run in zip(notes, runs, strict=True)]
    channels = {**channels, **({"drive_torque": ("Drive Torque [N m]", "N m")} if day.powered else {})}
    settings = {"fix": {"drag_coefficient": vehicle.drag_coefficient}} if fixed else {}
    records = [run.record for run in runs]
    return write(folder, "coastdown", coast.known(vehicle, day), channels, records, notes, settings=settings)


def _coastdown(seed: int, folder: Path, day: coast.Day, fixed: bool) -> Made:
    vehicle = random_vehicle(seed)
    path = coast_downs(vehicle, seed, folder, day, fixed)
    _state_calm(path)
    info = coast_information(vehicle, seed, day)
    truth = coast.truth(vehicle)
    if fixed:
        info, truth = info.known(["drag_area"]), {"rolling_resistance": truth["rolling_resistance"]}
    return Made(path, truth, info.bound())


def _state_calm(path: Path) -> None:
    """State in a description what the bound knows: no air moves across the road."""
    described = yaml.safe_load(path.read_text(encoding="utf-8"))
    described["settings"] = {**described.get("settings", {}), "crosswind": "0 m/s"}
    path.write_text(yaml.safe_dump(described, sort_keys=False), encoding="utf-8")


def _area(seed: int, folder: Path) -> Made:
    """A photo from near, corners, box and distances read with errors as stated; the picture itself adds hardly any."""
    vehicle, rng = random_vehicle(seed), np.random.default_rng([seed, 0xAE])
    shot = silhouette.photo(vehicle, seed, distance=rng.uniform(10.0, 30.0), depth=rng.uniform(-0.3, 0.6))
    (folder / "photo.png").write_bytes(shot.png)

    def ruled(value: float, sd: float) -> str:
        return f"{rng.normal(value, sd)!r} +- {sd!r} m"

    corner, tape, pace, depth = 0.5, 2e-3, 0.1, 0.02
    edges = dict(zip(("left", "top", "right", "bottom"), rng.normal(shot.box, corner).tolist(), strict=True))
    box = {"width": ruled(shot.box_width, tape), "height": ruled(shot.box_height, tape), **edges}
    settings = {"camera_distance": ruled(shot.distance, pace), "vehicle_depth": ruled(shot.depth, depth)}
    path = write(folder, "area", {}, {}, [], image="photo.png", box=box, settings=settings)
    left, top, right, bottom = shot.box
    parts = [tape / shot.box_width, tape / shot.box_height]
    parts += [2**0.5 * corner / (right - left), 2**0.5 * corner / (bottom - top)]
    behind = shot.distance + shot.depth
    parts += [2 * depth / behind, 2 * pace * shot.depth / (shot.distance * behind)]
    return Made(path, silhouette.truth(vehicle), {"frontal_area": vehicle.frontal_area * float(np.linalg.norm(parts))})


def launches(vehicle: Vehicle, seed: int, folder: Path, effects: Mapping[str, float] = NOTHING) -> Path:
    """Accelerate-and-brake runs."""
    runs = cg.campaign(vehicle, seed, effects)
    channels = {
        "time": ("Time [s]", "s"),
        "front_left_load": ("FL Fz [N]", "N"),
        "front_right_load": ("FR Fz [N]", "N"),
        "rear_left_load": ("RL Fz [N]", "N"),
        "rear_right_load": ("RR Fz [N]", "N"),
        "acceleration": ("Antenna Accel [m/s^2]", "m/s^2"),
        "pitch_rate": ("Pitch Rate [deg/s]", "deg/s"),
        "speed": ("Speed [km/h]", "km/h"),
    }
    records, directions = [run.record for run in runs], [{"direction": run.direction} for run in runs]
    settings = {"accelerometer": "gps", "load_zero": cg.LOAD.zero}
    return write(folder, "cg", cg.known(vehicle), channels, records, directions, settings=settings)


def _cg(seed: int, folder: Path) -> Made:
    vehicle = random_vehicle(seed)
    return Made(launches(vehicle, seed, folder), cg.truth(vehicle), cg.information(vehicle, seed).bound())


def crossings(vehicle: Vehicle, seed: int, folder: Path, effects: Mapping[str, float] = NOTHING) -> Path:
    """Crossings of the bump."""
    return describe_crossings(vehicle, folder, bump.campaign(vehicle, seed, effects))


def describe_crossings(vehicle: Vehicle, folder: Path, records: Sequence[Record]) -> Path:
    """The logs of crossings with their description."""
    channels = {
        "time": ("Time [s]", "s"),
        "front_load": ("Front Load [N]", "N"),
        "rear_load": ("Rear Load [N]", "N"),
        "speed": ("Speed [km/h]", "km/h"),
        "vertical_acceleration": ("Vertical Accel [m/s^2]", "m/s^2"),
        "pitch_rate": ("Pitch Rate [deg/s]", "deg/s"),
    }
    places = [{"distance_front": f"{bump.DISTANCE} +- {bump.DISTANCE_SD} m"} for _ in records]
    shape = bump.Bump()
    obstacle = {"height": shape.height, "width": shape.width, "shape": shape.shape}
    settings = {
        "load_zero": bump.WHEEL_FORCE.zero,
        "acceleration_zero": bump.ACCELEROMETER.zero,
        "pitch_rate_zero": float(bump.GYRO.zero),
        "speed_scale": bump.SPEED_SCALE_SD,
    }
    return write(folder, "bump", bump.known(vehicle), channels, records, places, bump=obstacle, settings=settings)


def _bump(seed: int, folder: Path) -> Made:
    vehicle = random_vehicle(seed)
    return Made(crossings(vehicle, seed, folder), bump.truth(vehicle), bump.information(vehicle, seed).bound())


def wheel_drives(vehicle: Vehicle, seed: int, folder: Path, effects: Mapping[str, float] = NOTHING) -> Path:
    """Drives with a force sensor at the hub."""
    channels = {
        "time": ("Time [s]", "s"),
        "hub_torque": ("Hub Torque [N m]", "N m"),
        "wheel_speed": ("Wheel Speed [rad/s]", "rad/s"),
        "hub_force_x": ("Hub Fx [N]", "N"),
        "hub_force_z": ("Hub Fz [N]", "N"),
        "acceleration": ("Accel [m/s^2]", "m/s^2"),
        "vehicle_speed": ("Speed [km/h]", "km/h"),
    }
    settings = {"torque_zero": wheel.WHEEL_TORQUE.zero, "force_zero": wheel.WHEEL_FORCE.zero}
    records = wheel.campaign(vehicle, seed, effects)
    return write(folder, "inertia", wheel.known(vehicle), channels, records, settings=settings)


def _inertia(seed: int, folder: Path) -> Made:
    vehicle = random_vehicle(seed)
    return Made(wheel_drives(vehicle, seed, folder), wheel.truth(vehicle), wheel.information(vehicle, seed).bound())


# How well a tester weighs and measures the pendulum, standard deviations in SI.
RULER = {"mass": 0.01, "pivot_distance": 1e-4, "separation": 2e-4, "length": 1e-3, "torsional_stiffness": 0.05}
UNITS = dict.fromkeys(RULER, "m") | {"mass": "kg", "torsional_stiffness": "N m/rad"}


def _pendulum(seed: int, folder: Path, kind: str) -> Made:
    """A recording; the tester's scales and ruler err within what he states, and the bound reckons with that too."""
    vehicle = random_vehicle(seed)
    rng = np.random.default_rng([seed, 0xAB])
    hung = pendulum.known(vehicle, kind)
    sd = {name: RULER[name] for name in hung}
    (log,) = pendulum.campaign(vehicle, seed, kind=kind)
    (folder / "pendulum.csv").write_bytes(csv_bytes(log))
    stated = {name: f"{rng.normal(value, sd[name])!r} +- {sd[name]!r} {UNITS[name]}" for name, value in hung.items()}
    channels = {"time": ("Time [s]", "s"), "angular_rate": ("Angular Rate [rad/s]", "rad/s")}
    rig = {
        "kind": kind,
        **stated,
        "gravity": f"{GRAVITY} m/s^2",
        "log": "pendulum.csv",
        "channels": {name: {"column": column, "unit": unit} for name, (column, unit) in channels.items()},
    }
    path = write(folder, "inertia", {}, {}, [], pendulum=rig)
    swing = pendulum.information(vehicle, seed, kind).bound()["wheel_inertia"]
    bound = np.hypot(swing, pendulum.by_ruler(vehicle, kind, sd))
    return Made(path, pendulum.truth(vehicle), {"wheel_inertia": float(bound)})


def tire_sweeps(
    vehicle: Vehicle, seed: int, folder: Path, peak: bool = True, effects: Mapping[str, float] = NOTHING
) -> Path:
    """Slip sweeps."""
    channels = {
        "time": ("Time [s]", "s"),
        "wheel_speed": ("Wheel Speed [rad/s]", "rad/s"),
        "vehicle_speed": ("Vehicle Speed [km/h]", "km/h"),
        "force_x": ("Fx [N]", "N"),
        "force_z": ("Fz [N]", "N"),
    }
    return write(folder, "tire", tire.known(vehicle), channels, tire.campaign(vehicle, seed, effects, peak=peak))


def _tire(seed: int, folder: Path, peak: bool) -> Made:
    vehicle = random_vehicle(seed)
    path = tire_sweeps(vehicle, seed, folder, peak)
    info = tire.information(vehicle, seed, peak=peak)
    slope = "tire_longitudinal_stiffness"
    bound = {slope: tire.stiffness_bound(vehicle, info)} | (info.bound() if peak else {})
    return Made(path, {name: tire.truth(vehicle)[name] for name in bound}, bound)


@dataclass(frozen=True)
class Drawing:
    """Both half-shafts' sections and shear modulus as read, and how far off each side's stiffness may be, N m/rad."""

    sections: Mapping[str, Sequence[Mapping[str, str]]]
    shear_modulus: str
    bound: Mapping[str, float]


def read_drawing(vehicle: Vehicle, seed: int) -> Drawing:
    """Each diameter, length and the shear modulus read with errors as stated."""
    rng = np.random.default_rng([seed, 0xD4])
    shear, modulus_sd = vehicle.shear_modulus, 0.3e9
    sides: dict[str, list[dict[str, str]]] = {}
    bound = {}
    for side in shaft.PATTERN:
        true = shaft.drawing(vehicle, side)
        exact = shaft.stiffness(true, shear)
        parts = [modulus_sd / shear * exact]
        sides[side] = []
        for k, section in enumerate(true):
            row = {}
            for name, sd in (("outer_diameter", 5e-5), ("inner_diameter", 5e-5), ("length", 2e-4)):
                if (value := getattr(section, name)) == 0:
                    continue
                row[name] = f"{rng.normal(value, sd)!r} +- {sd!r} m"
                moved = [*true[:k], replace(section, **{name: value + sd}), *true[k + 1 :]]
                parts.append(shaft.stiffness(moved, shear) - exact)
            sides[side].append(row)
        bound[side] = float(np.linalg.norm(parts))
    return Drawing(sides, f"{rng.normal(shear, modulus_sd)!r} +- {modulus_sd!r} Pa", bound)


def _drawing(seed: int, folder: Path) -> Made:
    vehicle = random_vehicle(seed)
    read = read_drawing(vehicle, seed)
    path = write(folder, "shaft", {}, {}, [], sections=read.sections, shear_modulus=read.shear_modulus)
    bound = {f"shaft_stiffness_{side}": sd for side, sd in read.bound.items()}
    return Made(path, {name: shaft.truth(vehicle)[name] for name in bound}, bound)


def tip_in(
    vehicle: Vehicle, seed: int, folder: Path, effects: Mapping[str, float] = NOTHING, drawing: Drawing | None = None
) -> Path:
    """One tip-in of the left half-shaft; with its drawing where that is given."""
    channels = {
        "time": ("Time [s]", "s"),
        "shaft_torque": ("Shaft Torque [N m]", "N m"),
        "motor_speed": ("Motor Speed [rad/s]", "rad/s"),
        "wheel_speed": ("Wheel Speed [rad/s]", "rad/s"),
        "twist": ("Twist [deg]", "deg"),
    }
    records = shaft.campaign(vehicle, seed, effects)
    if drawing is None:
        return write(folder, "shaft", shaft.known(vehicle), channels, records, [{"side": "left"}])
    sections = {"left": drawing.sections["left"]}
    more = {"sections": sections, "shear_modulus": drawing.shear_modulus}
    return write(folder, "shaft", {}, channels, records, [{"side": "left"}], **more)


def _shaft(seed: int, folder: Path) -> Made:
    vehicle = random_vehicle(seed)
    path = tip_in(vehicle, seed, folder)
    truth = {name: shaft.truth(vehicle)[name] for name in ("shaft_stiffness_left", "shaft_damping_left")}
    return Made(path, truth, shaft.information(vehicle, seed).bound())


CASES: dict[str, Case] = {
    "area": Case("area", "A silhouette; box, corners, camera distance and depth read with errors as stated.", _area),
    "coastdown": Case(
        "coastdown",
        "Eight coasts from 75 to 20 km/h, drag coefficient fixed as in the paper.",
        lambda seed, folder: _coastdown(seed, folder, coast.DAY, fixed=True),
    ),
    "coastdown_wide": Case(
        "coastdown",
        "Eight coasts from 36 to 2 m/s, rolling resistance and drag area both unknown.",
        lambda seed, folder: _coastdown(seed, folder, coast.WIDE, fixed=False),
    ),
    "cg": Case("cg", "Four accelerate-and-brake runs.", _cg),
    "bump": Case("bump", "Four crossings of a haversine bump, wheels lifting off.", _bump),
    "inertia": Case("inertia", "Three drives with throttle and brake steps.", _inertia),
    **{
        f"pendulum_{kind}": Case(
            "inertia",
            f"Gyro recording of the wheel as a {kind} pendulum, weighed and measured with errors as stated.",
            lambda seed, folder, kind=kind: _pendulum(seed, folder, kind),  # type: ignore[misc]
        )
        for kind in ("compound", "bifilar", "torsional")
    },
    "tire": Case("tire", "Five slip sweeps, beyond the peak.", lambda seed, folder: _tire(seed, folder, True)),
    "tire_short": Case(
        "tire",
        "Five sweeps below half the peak; the bound knows nothing of how such curves go on.",
        lambda seed, folder: _tire(seed, folder, False),
    ),
    "shaft_drawing": Case("shaft", "Drawings of both half-shafts, read with errors as stated.", _drawing),
    "shaft": Case("shaft", "One tip-in of the left half-shaft.", _shaft),
}
