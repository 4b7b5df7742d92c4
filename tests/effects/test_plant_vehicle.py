"""A cause of size q in the plant's drives is a cause of size q in the vehicle: the same change of what is measured."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.physics.models.vehicle_cases import parameters
from tests.plant.drive import noise_free
from tests.plant.drive_motion import Pedals
from tests.plant.vehicle import random_vehicle
from vdyn_cli.effects import catalog
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.physics.models.vehicle import vehicle

EFFECTS = {effect.name: effect for effect in catalog()}
CAR = random_vehicle(4)
TORQUE = 1.5 * CAR.mass * CAR.wheel_radius / CAR.gear_ratio
# Tip in, back out, tip in again, coast: on the way back, so that what turns with the direction shows its sign.
PEDALS = Pedals(
    knots=(0.0, 0.3, 0.5, 3.0, 3.2, 4.0, 4.2, 6.5, 6.7, 8.0),
    drive=(0.0, 0.0, TORQUE, TORQUE, -0.2 * TORQUE, -0.2 * TORQUE, TORQUE, TORQUE, 0.0, 0.0),
    brake=(0.0,) * 10,
    uphill=-1.0,
    temperature=10.0,
)
COLUMNS = {
    "speed": "Speed [km/h]",
    "shaft_torque_left": "Shaft Torque Left [N m]",
    "wheel_speed_fl": "Wheel Speed FL [rad/s]",
}
# Size in the plant, the channel that shows it best, and what the plant's size is of in the program's unit.
CASES = {
    "extra_drag_area": (0.3, "speed", 1.0),
    "headwind": (4.0, "speed", 1.0),
    "road_grade": (0.005, "speed", 1.0),
    "speed_dependent_rolling": (3e-4, "speed", 1.0),
    "tire_warmup": (0.3, "speed", 1.0),
    "temperature_rolling": (0.02, "speed", 1.0),
    "brake_drag": (80.0, "speed", 1.0),
    "brake_drag_fading": (80.0, "speed", 1.0),
    "driveline_drag": (80.0, "speed", 1.0),
    "driveline_dry_loss": (25.0, "speed", 1.0),
    "rotating_mass": (80.0, "speed", 1.0),
    "mass_error": (0.05, "speed", 1.0),
    "wheel_radius": (0.02, "wheel_speed_fl", 1.0),
    "wheel_inertia": (0.3, "speed", 1.0),
    "motor_inertia": (2.0, "shaft_torque_left", 1.0),
    "shaft_stiffness": (-0.3, "shaft_torque_left", 1.0),
    "shaft_damping": (0.8, "shaft_torque_left", 1.0),
    "tire_relaxation": (0.5, "shaft_torque_left", CAR.tire_relaxation_length),
    "slip_stiffness": (-0.3, "wheel_speed_fl", 1.0),
    "backlash": (0.01, "shaft_torque_left", 1.0),
    "speed_scale": (0.02, "speed", 1.0),
    "speed_delay": (0.05, "speed", 1.0),
}
WITHIN = 0.02  # of the change's rms
# The vehicle's hubs pitch with the body, the plant's do not: their half-shafts shake at slightly other frequencies.
SIZE, SHAPE = 0.08, 0.95  # the change in the other's terms, and their correlation


@cache
def true(name: str) -> dict[str, np.ndarray]:
    effects = {name: CASES[name][0]} if name else {}
    return noise_free(CAR, [PEDALS], effects)[0]


@cache
def mine(name: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    effects = (EFFECTS[name],) if name else ()
    q = {next(iter(EFFECTS[name].unknowns)): CASES[name][0] * CASES[name][2]} if name else {}
    time = np.arange(0.0, PEDALS.knots[-1] + 1e-9, 1e-3)
    inputs = dict.fromkeys(vehicle().inputs, 0.0)
    inputs |= {"drive_torque": np.interp(time, PEDALS.knots, PEDALS.drive), "elapsed": time}
    context = {"heading": PEDALS.uphill, "temperature": 273.15 + PEDALS.temperature}
    drive = Drive(time, inputs, {}, {}, context)
    return time, dict(Simulator(vehicle(), parameters(CAR) | q, (), effects)(drive).outputs)


@pytest.mark.parametrize("name", CASES)
def test_a_drive_changes_as_in_the_plant(name):
    _, channel, _ = CASES[name]
    column = COLUMNS[channel]
    changed = true(name)[column] - true("")[column]
    time, with_it = mine(name)
    told = np.interp(true("")["Time [s]"], time, with_it[channel] - mine("")[1][channel])
    if channel != "shaft_torque_left" and name != "slip_stiffness":  # slip follows the half-shafts' torque
        assert np.sqrt(np.mean((told - changed) ** 2) / np.mean(changed**2)) < WITHIN
    else:
        assert (told @ changed) / (changed @ changed) == pytest.approx(1.0, abs=SIZE)
        assert np.corrcoef(told, changed)[0, 1] > SHAPE
