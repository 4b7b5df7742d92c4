"""The full vehicle as its tests drive it: the plant's cars, and drives on a flat, still day unless they say else."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tests.plant.vehicle import REFERENCE, Vehicle
from vdyn_cli.engine.simulate import Drive, Simulated, Simulator
from vdyn_cli.physics.models.vehicle import vehicle

Array = NDArray[np.float64]

CORNERS = ("fl", "fr", "rl", "rr")
CONTEXT = {"heading": 1.0, "temperature": 293.15}
_PLANT = (
    *("mass", "wheelbase", "cg_to_front", "cg_height", "track_front", "track_rear", "pitch_inertia"),
    *("unsprung_mass_front", "unsprung_mass_rear", "suspension_stiffness_front", "suspension_stiffness_rear"),
    *("suspension_damping_front", "suspension_damping_rear", "tire_vertical_stiffness", "wheel_inertia"),
    *("wheel_radius", "tire_B", "tire_C", "tire_D", "tire_E", "tire_relaxation_length", "rolling_resistance"),
    *("drag_area", "drag_height", "gear_ratio", "driveline_inertia", "shaft_stiffness_left"),
    *("shaft_stiffness_right", "shaft_damping_left", "shaft_damping_right", "side_gear_inertia"),
)


def parameters(car: Vehicle = REFERENCE, **changed: float) -> dict[str, float]:
    """The vehicle model's parameters of one of the plant's cars."""
    found = {name: float(getattr(car, name)) for name in _PLANT}
    found |= {"roll_inertia": 0.3 * car.pitch_inertia, "yaw_inertia": 1.1 * car.pitch_inertia, "air_density": 1.225}
    found |= {"tire_vertical_damping": 200.0, "tire_load_sensitivity": 2e-5, "tire_cornering_stiffness": 18.0}
    found |= {"tire_rest_damping": 1.0}
    found |= {
        "rolling_speed": 0.0,
        "wind_variance": 0.0,
        "driveline_efficiency": 1.0,
        "recuperation_loss": 0.0,
        "brake_share_front": 0.65,
    }
    found |= {"hub_swing": 1.0, "driveline_pitch": 1.0, "motor_reaction": 1.0 / car.gear_ratio}
    return found | changed


def drive(time: Array, start: dict[str, float] | None = None, **inputs: ArrayLike) -> Drive:
    """A drive of the axle-driven models on a flat road in still air, but for what is given."""
    still = dict.fromkeys(("drive_torque", "brake_torque", "grade", "wind_speed", "elapsed"), 0.0)
    still |= dict.fromkeys((f"road_{at}" for at in CORNERS), 0.0)
    return Drive(time, {**still, **inputs}, start or {}, {}, CONTEXT)


@cache
def _simulator(driven: str, substeps: int, differential: str) -> Simulator:
    model = vehicle(driven, differential=differential)  # type: ignore[arg-type]
    return Simulator(model, {name: parameters()[name] for name in model.parameters}, substeps=substeps)


def simulate(
    run: Drive,
    car: dict[str, float] | None = None,
    driven: str = "front",
    substeps: int = 1,
    differential: str = "open",
) -> Simulated:
    """Outputs and states of a drive by the reference car, or with other ``car`` parameters."""
    simulator = _simulator(driven, substeps, differential)
    own = {name: value for name, value in (car or {}).items() if name in simulator.model.parameters}
    return simulator(Drive(run.time, run.inputs, run.start, own, run.context), states=True)


def pedals(time: Array, *knots: tuple[float, float, float]) -> dict[str, Array]:
    """Inputs from (time, drive torque, brake torque) knots."""
    at, torque, brake = np.array(knots).T
    return {"drive_torque": np.interp(time, at, torque), "brake_torque": np.interp(time, at, brake)}
