"""Drives on a hilly road, made without the program: hills, a late torque, losses, and an accelerometer with a zero."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

Array = NDArray[np.float64]

MASS, TURNING, PER_TORQUE = 1400.0, 60.0, 9.0 / 0.33
F0, F1, CDA, DENSITY = 110.0, 2.0, 0.60, 1.19
STEP, EVERY = 0.02, 5  # s of the integration, and its steps to a row of the log
G = 9.81


@dataclass(frozen=True)
class Truth:
    """What is hidden: hills' scatter, share of the torque lost, accelerometer's zero m/s^2, scatter of the load kg."""

    hills: float = 0.012
    loss: float = 0.10
    zero: float = 0.04
    load: float = 15.0


@dataclass(frozen=True)
class Made:
    """One drive at 10 Hz, with the slope that was there."""

    time: Array
    speed: Array
    torque: Array
    felt: Array
    slope: Array


def drive(truth: Truth, seed: int, seconds: float = 300.0) -> Made:
    """A driver who holds changing speeds with torque above zero, over a road of its own."""
    random = np.random.default_rng(seed)
    mass = MASS + truth.load * random.standard_normal()
    road = _road(random, truth.hills)
    wanted = np.repeat(random.uniform(12.0, 32.0, int(seconds / 20) + 1), int(20 / STEP))
    gust, torque, speed, place, earlier = 0.0, 40.0, float(wanted[0]), 0.0, 0.0
    rows = []
    for k in range(int(seconds / STEP)):
        gust += -gust * STEP / 8.0 + 0.5 * np.sqrt(2 * STEP / 8.0) * random.standard_normal()
        slope = float(np.interp(place, *road))
        hold = (F0 + F1 * speed + 0.5 * DENSITY * CDA * speed**2 + mass * G * slope) / PER_TORQUE
        asked = np.clip(hold + 12.0 * (wanted[k] - speed), 4.0, 200.0)
        before, torque = torque, torque + (asked - torque) * STEP / 0.5
        air = 0.5 * DENSITY * CDA * (speed + gust) ** 2
        push = (1.0 - truth.loss) * torque * PER_TORQUE - F0 - F1 * speed - air
        rate = (push - mass * G * np.sin(np.arctan(slope))) / (mass + TURNING)
        if k % EVERY == 0:  # torque and rate hold for a step: at its start they are what lies between two of them
            felt = 0.5 * (earlier + rate) + G * np.sin(np.arctan(slope)) + truth.zero
            rows.append((k * STEP, speed, 0.5 * (before + torque), felt, slope))
        earlier = rate
        speed = max(speed + rate * STEP, 1.0)
        place += speed * STEP
    time, speeds, torques, felt, slopes = np.array(rows).T
    noise = random.standard_normal((3, time.size)) * np.array([[0.01], [0.5], [0.05]])
    return Made(time, speeds + noise[0], torques + noise[1], felt + noise[2], slopes)


def _road(random: np.random.Generator, size: float) -> tuple[Array, Array]:
    """Slope over the distance: hills of some hundred metres, level from end to end but for a little."""
    place = np.arange(0.0, 12_000.0, 20.0)
    hills = np.zeros(place.size)
    for k in range(1, place.size):
        hills[k] = hills[k - 1] * np.exp(-20 / 400) + np.sqrt(1 - np.exp(-40 / 400)) * random.standard_normal()
    smooth = np.convolve(hills, np.ones(9) / 9, "same")
    return place, size * (smooth - smooth[:300].mean()) + 0.001 * random.standard_normal()


def description(folder: Path, drives: list[Made], **settings: Any) -> Mapping[str, Any]:
    """Logs and the description that an engineer would write, who thinks the road flat and the driveline free."""
    for k, one in enumerate(drives):
        lines = ["t;v;T;a", *(f"{t:.2f};{v:.4f};{q:.3f};{f:.4f}" for t, v, q, f in _rows(one))]
        (folder / f"drive_{k}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return {
        "test": "validate",
        "vehicle": {
            "mass": f"{MASS} +- 15 kg",
            "rotating_mass": f"{TURNING} kg",
            "gear_ratio": 9.0,
            "wheel_radius": "330 mm",
            "driveline_efficiency": 1,
            "road_load_f0": f"{F0} +- 10 N",
            "road_load_f1": f"{F1} +- 0.5 N/(m/s)",
            "drag_area": f"{CDA} +- 0.03 m^2",
            "air_density": f"{DENSITY} kg/m^3",
        },
        "channels": {
            "time": {"column": "t", "unit": "s"},
            "speed": {"column": "v", "unit": "m/s"},
            "drive_torque": {"column": "T", "unit": "N m"},
            "acceleration": {"column": "a", "unit": "m/s^2"},
        },
        "runs": [{"log": f"drive_{k}.csv"} for k in range(len(drives))],
        "settings": {
            "model": "road_load",
            "windows": {"length": "20 s", "powered": True},
            "zeros": {"acceleration": "0.005 m/s^2"},
            "drives": {"slope": 0.003, "load": "20 kg"},
            **settings,
        },
    }


def _rows(one: Made) -> Any:
    return zip(one.time, one.speed, one.torque, one.felt, strict=True)


def written(folder: Path, described: Mapping[str, Any]) -> Path:
    path = folder / "drives.yaml"
    path.write_text(yaml.safe_dump(dict(described)), encoding="utf-8")
    return path
