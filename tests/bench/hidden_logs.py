"""Scenarios on disk: the logs with something hidden in them, and the description that a tester would write."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.bench import cases
from tests.plant import drive
from tests.plant.drive_information import GAINS, measured
from tests.plant.drive_motion import BRAKE_FRONT
from tests.plant.hidden import Scenario
from tests.plant.vehicle import Vehicle

Writer = Callable[[Scenario, Path], Path]


@dataclass(frozen=True)
class Made:
    """A description on disk; ``truth`` is what is hidden in its logs, ``scenario`` what more there is to know."""

    description: Path
    scenario: Scenario

    @property
    def truth(self) -> dict[str, float]:
        return dict(self.scenario.effects)

    @property
    def t(self) -> dict[str, float]:
        return self.scenario.evidence().t()

    @property
    def rivals(self) -> dict[str, dict[str, float]]:
        return self.scenario.evidence().rivals()


def make(scenario: Scenario, folder: Path) -> Made:
    """Write the scenario's logs and description into ``folder``."""
    path = WRITERS[scenario.step](scenario, folder)
    if scenario.fault:
        damage(sorted(folder.glob(f"{scenario.step}_*.csv")), scenario.fault)
    return Made(path, scenario)


def _coastdown(scenario: Scenario, folder: Path) -> Path:
    way = scenario.way
    assert way.day is not None
    channels = {**cases.COAST_CHANNELS, "position": ("Position [m]", "m")}
    vehicle, seed = scenario.vehicle, scenario.drawn
    return cases.coast_downs(vehicle, seed, folder, way.day, way.fixed, scenario.effects, channels)


def _tire(scenario: Scenario, folder: Path) -> Path:
    return cases.tire_sweeps(scenario.vehicle, scenario.drawn, folder, effects=scenario.effects)


def _shaft(scenario: Scenario, folder: Path) -> Path:
    drawing = cases.read_drawing(scenario.vehicle, scenario.seed) if scenario.variant == "drawn" else None
    return cases.tip_in(scenario.vehicle, scenario.drawn, folder, scenario.effects, drawing)


DRIVE_CHANNELS = {
    "time": ("Time [s]", "s"),
    "drive_torque": ("Drive Torque [N m]", "N m"),
    "brake_torque": ("Brake Torque [N m]", "N m"),
    "speed": ("Speed [km/h]", "km/h"),
    **{f"wheel_speed_{wheel.lower()}": (f"Wheel Speed {wheel} [rad/s]", "rad/s") for wheel in drive.WHEELS},
    "shaft_torque_left": ("Shaft Torque Left [N m]", "N m"),
    "shaft_torque_right": ("Shaft Torque Right [N m]", "N m"),
    "acceleration": ("Long Accel [m/s^2]", "m/s^2"),
}
DRIVE_KNOWN = (
    *("mass", "wheelbase", "cg_to_rear", "cg_height", "pitch_inertia", "track_front", "track_rear", "drag_height"),
    *("drag_area", "rolling_resistance", "wheel_inertia", "wheel_radius", "driveline_inertia", "gear_ratio"),
    *("unsprung_mass_front", "unsprung_mass_rear", "suspension_stiffness_front", "suspension_stiffness_rear"),
    *("suspension_damping_front", "suspension_damping_rear", "tire_B", "tire_C", "tire_D"),
    *("tire_E", "tire_relaxation_length", "shaft_stiffness_left", "shaft_stiffness_right", "shaft_damping_left"),
    "shaft_damping_right",
)


def _validate(scenario: Scenario, folder: Path) -> Path:
    runs = drive.campaign(scenario.vehicle, scenario.drawn, scenario.effects)
    return validation(scenario.vehicle, scenario.seed, runs, folder)


def validation(vehicle: Vehicle, seed: int, runs: Sequence[drive.Run], folder: Path) -> Path:
    """Drives, and parameters as measured before them: each off by about the standard deviation that it states."""
    known: dict[str, float | str] = {name: float(getattr(vehicle, name)) for name in DRIVE_KNOWN}
    known |= {
        "air_density": drive.RIG.air_density,
        "brake_share_front": BRAKE_FRONT,
        "tire_load_sensitivity": 0.0,
        "tire_vertical_stiffness": UNYIELDING,
        "driveline_efficiency": 1.0,
        "hub_swing": 0.0,
        "driveline_pitch": 0.0,
    }
    for name, (value, sd) in measured(vehicle, seed).items():
        known[name] = f"{value!r} +- {sd!r} {UNITS.get(name, '')}".strip()
    settings = {
        "driven": "front",
        "zeros": {
            "acceleration": drive.RIG.acceleration.zero,
            "shaft_torque": drive.RIG.shaft_torque.zero,
            "drive_torque": drive.RIG.torque.zero,
        },
        "gains": {name: sd for name, (_, sd) in GAINS.items()},
    }
    notes = [{"direction": run.direction, "temperature": f"{run.temperature:.1f} degC"} for run in runs]
    records = [run.record for run in runs]
    return cases.write(folder, "validate", known, DRIVE_CHANNELS, records, notes, settings=settings)


UNYIELDING = 5e6  # N/m, the stiffest that is physical: these cars' tires do not give way vertically
UNITS = {"mass": "kg", "drag_area": "m^2", "wheel_inertia": "kg m^2", "wheel_radius": "m",
         "driveline_inertia": "kg m^2", "tire_relaxation_length": "m", "shaft_stiffness_left": "N m/rad",
         "shaft_stiffness_right": "N m/rad", "shaft_damping_left": "N m s/rad",
         "shaft_damping_right": "N m s/rad"}  # fmt: skip


def _plain(write: Callable[..., Path]) -> Writer:
    return lambda scenario, folder: write(scenario.vehicle, scenario.drawn, folder, scenario.effects)


WRITERS: dict[str, Writer] = {
    "coastdown": _coastdown,
    "cg": _plain(cases.launches),
    "bump": _plain(cases.crossings),
    "inertia": _plain(cases.wheel_drives),
    "tire": _tire,
    "shaft": _shaft,
    "validate": _validate,
}

# Channels that break in a sensor fault, by step; the header as logged.
FRAGILE = {
    "coastdown": "GPS Speed [km/h]",
    "cg": "FL Fz [N]",
    "bump": "Front Load [N]",
    "inertia": "Hub Torque [N m]",
    "tire": "Fx [N]",
    "shaft": "Shaft Torque [N m]",
    "validate": "Speed [km/h]",
}


def damage(logs: list[Path], fault: str) -> None:
    """Break a channel of every third log: ``stuck`` holds one value for a fifth of the log, ``clipped`` cuts the top.

    A logger goes on writing; nothing in the file says that anything is wrong.
    """
    for path in logs[::3]:
        with path.open(encoding="utf-8", newline="") as file:
            head, *rows = list(csv.reader(file))
        column = head.index(next(FRAGILE[step] for step in FRAGILE if path.name.startswith(step)))
        values = [float(row[column]) for row in rows]
        if fault == "stuck":
            start, stop = int(0.4 * len(rows)), int(0.6 * len(rows))
            broken = [values[start] if start <= k < stop else value for k, value in enumerate(values)]
        elif fault == "clipped":
            top = sorted(values)[int(0.85 * len(values))]
            broken = [min(value, top) for value in values]
        else:
            raise ValueError(f"no such fault: {fault}")
        for row, value in zip(rows, broken, strict=True):
            row[column] = f"{value:.2f}"
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerows([head, *rows])
