"""A parameter file of a fictitious car, in the form that the pipeline writes."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from vdyn_cli.effects import catalog
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.export.exported_vehicle import ExportedVehicle
from vdyn_cli.export.parameter_file import ParameterFile, read_parameter_file
from vdyn_cli.quantities.parameters import ESTIMATED_BY
from vdyn_cli.quantities.vocabulary import PARAMETERS

# Value and standard deviation, SI.
CAR: Mapping[str, tuple[float, float]] = {
    "mass": (1430.0, 2.0),
    "wheelbase": (2.62, 0.0),
    "track_front": (1.51, 0.0),
    "cg_to_front": (1.13, 0.002),
    "cg_height": (0.57, 0.003),
    "pitch_inertia": (1980.0, 12.0),
    "unsprung_mass_front": (78.0, 0.0),
    "unsprung_mass_rear": (66.0, 0.0),
    "suspension_stiffness_front": (41e3, 90.0),
    "suspension_stiffness_rear": (38e3, 80.0),
    "suspension_damping_front": (2900.0, 20.0),
    "suspension_damping_rear": (2600.0, 20.0),
    "tire_vertical_stiffness": (3.7e5, 900.0),
    "wheel_inertia": (1.1, 0.01),
    "wheel_radius": (0.297, 0.0005),
    "rotating_mass": (85.0, 0.0),
    "tire_B": (11.3, 0.1),
    "tire_C": (1.58, 0.01),
    "tire_D": (0.97, 0.002),
    "tire_E": (0.21, 0.02),
    "tire_relaxation_length": (0.24, 0.02),
    "rolling_resistance": (0.0104, 1e-4),
    "drag_area": (0.61, 0.01),
    "road_load_f0": (141.0, 1.5),
    "road_load_f1": (0.4, 0.2),
    "road_load_f2": (0.36, 0.004),
    "gear_ratio": (3.9, 0.0),
    "shaft_stiffness_left": (11e3, 60.0),
    "shaft_stiffness_right": (8.6e3, 50.0),
    "shaft_damping_left": (25.0, 1.0),
}
BRAKE_DRAG = {"effect": "brake_drag", "unknowns": {"brake_drag": {"value": 38.0, "std": 3.0, "unit": "N"}}}
HEADWIND = {"effect": "headwind", "unknowns": {"headwind": {"value": 2.9, "std": 0.1, "unit": "m/s"}}}
SPEED_SCALE = {"effect": "speed_scale", "unknowns": {"speed_scale": {"value": 0.01, "std": 0.001, "unit": ""}}}
LEARNED = "learned_road_load"  # drag that has a hump at 5 m/s, as a coast-down would leave it
LEARNED_LAW: Mapping[str, Any] = {
    "element": "driveline",
    "label": "the learned law of the resistance to motion",
    "tags": [],
    "curves": [
        {
            "place": "",
            "coordinate": "speed",
            "coordinate_unit": "m/s",
            "unit": "N",
            "factor": "",
            "span": [0.0, 40.0],
            "scale": 0.0,
            "anchored": False,
            "form": "bump",
            "unknowns": [f"{LEARNED}_size", f"{LEARNED}_center", f"{LEARNED}_width"],
        }
    ],
}
LEARNED_SIZES = {f"{LEARNED}_size": 90.0, f"{LEARNED}_center": 5.0, f"{LEARNED}_width": 2.0}


def document(
    causes: Sequence[Any] = (),
    verdict: str = "named",
    without: Sequence[str] = (),
    extensions: Mapping[str, Mapping[str, float]] = MappingProxyType({}),
    laws: Mapping[str, Any] = MappingProxyType({}),
) -> dict[str, Any]:
    """The JSON document, with the causes that a diagnosis named and those that the model was extended by.

    ``laws``: definitions of learned laws among the extensions.
    """
    parameters = {
        name: {
            "value": value,
            "std": std,
            "interval95": [value - 2 * std, value + 2 * std],
            "unit": PARAMETERS[name].unit,
            "meaning": PARAMETERS[name].meaning,
            "source": ESTIMATED_BY.get(name, "given"),
            "baseline": None,
        }
        for name, (value, std) in CAR.items()
        if name not in without
    }
    entry = {"std": 0.0, "interval95": [0.0, 0.0], "unit": "", "meaning": "", "source": "coastdown", "baseline": None}
    lasting = {
        effect: {name: {**entry, "value": value, "unit": _unit(name)} for name, value in unknowns.items()}
        for effect, unknowns in extensions.items()
    }
    diagnosis = {"verdict": verdict, "causes": list(causes)}
    return {
        "format": "vdyn/parameters/1",
        "step": "pipeline",
        "title": "a car that nobody has",
        "parameters": parameters,
        "extensions": lasting,
        **({"laws": dict(laws)} if laws else {}),
        "diagnosis": diagnosis,
    }


def _unit(unknown: str) -> str:
    """The SI unit of an effect's unknown; empty where no effect has it."""
    return next((effect.unknowns[unknown].unit for effect in catalog() if unknown in effect.unknowns), "")


def written(folder: Path, **changes: Any) -> Path:
    """The document in a file."""
    path = folder / "parameters.json"
    path.write_text(json.dumps(document(**changes)), encoding="utf-8")
    return path


def given(folder: Path, **changes: Any) -> ParameterFile:
    """The document, read."""
    return read_parameter_file(written(folder, **changes))


def stop_and_go(duration: float = 12.0, step: float = 1e-3) -> tuple[np.ndarray, dict[str, Any]]:
    """Rest, a tip-in with a rough torque, coasting, a stop on a slope, and standing there: time and inputs."""
    time = np.arange(round(duration / step) + 1) * step
    rough = np.random.default_rng(5).normal(0.0, 20.0, time.size)
    driving = (time > 0.5) & (time < 5.0)
    inputs = dict.fromkeys(("wind_speed", "road_fl", "road_fr", "road_rl", "road_rr"), np.zeros(time.size))
    inputs["drive_torque"] = np.where(driving, 260.0 + rough, 0.0)
    inputs["brake_torque"] = np.where(time > 6.5, 1700.0, np.where(time < 0.4, 900.0, 0.0))
    inputs["grade"] = 0.05 * np.ones(time.size)
    inputs["elapsed"] = time
    return time, inputs


def simulated(
    car: ExportedVehicle, time: np.ndarray, inputs: Mapping[str, Any], speed: float, substeps: int = 1
) -> dict:
    """What Python makes of the same drive."""
    context = {name: car.values[name] for name in car.model.context}
    own = {name: value for name, value in car.values.items() if name not in context}
    simulator = Simulator(car.model, own, (), car.effects, substeps)
    start = {"speed": speed}
    return dict(simulator(Drive(time, inputs, start, context=context), sensitivities=False).outputs)
