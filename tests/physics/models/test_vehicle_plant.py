"""The vehicle against the truth plant's drives: the same road, other equations, another integrator.

The plant has brakes on the frame rather than on pitching hubs, slip from the speed of the center of gravity rather
than of the hubs, and friction that turns over 0.02 m/s of rim speed and so never holds.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.physics.models.vehicle_cases import Array, drive, parameters, simulate
from tests.plant import drive as plant
from tests.plant.vehicle import random_vehicle

COLUMNS = {
    "speed": "Speed [km/h]",
    "wheel_speed_fl": "Wheel Speed FL [rad/s]",
    "wheel_speed_rr": "Wheel Speed RR [rad/s]",
    "shaft_torque_left": "Shaft Torque Left [N m]",
    "shaft_torque_right": "Shaft Torque Right [N m]",
    "acceleration": "Long Accel [m/s^2]",
}
# Root mean square and largest departure, a few percent of the plant's sensor noise, and at the stop.
CLOSE = {
    "speed": (3e-3, 8e-3),
    "wheel_speed_fl": (0.012, 0.08),
    "wheel_speed_rr": (0.012, 0.08),
    "shaft_torque_left": (0.5, 5.0),
    "shaft_torque_right": (0.5, 5.0),
    "acceleration": (5e-3, 0.06),
}
STOP = {"speed": 0.15, "wheel_speed_fl": 0.3, "acceleration": 1.0}


@pytest.fixture(scope="module", params=[3, pytest.param(5, marks=pytest.mark.slow)])
def departures(request: pytest.FixtureRequest) -> tuple[Array, dict[str, Array], float]:
    car = random_vehicle(request.param)
    plan = plant.pedals(car, request.param)[2]
    (true,) = plant.noise_free(car, [plan])
    time = np.arange(0.0, plan.knots[-1], 1e-3)
    inputs = {"drive_torque": plan.drive, "brake_torque": plan.brake}
    run = drive(time, **{n: np.interp(time, plan.knots, v) for n, v in inputs.items()})
    found = simulate(run, parameters(car))
    at = true["Time [s]"]
    off = {n: np.interp(at, time, found.outputs[n]) - true[column] for n, column in COLUMNS.items()}
    moving = at[np.flatnonzero(true["Speed [km/h]"] > 0.5)[-1]]
    return at, off, float(moving)


@pytest.mark.parametrize("name", COLUMNS)
def test_it_drives_as_the_plant_does(name: str, departures: tuple[Array, dict[str, Array], float]) -> None:
    at, off, stop = departures
    driving, rms, most = at < stop, *CLOSE[name]
    assert np.sqrt(np.mean(off[name][driving] ** 2)) < rms
    assert np.max(np.abs(off[name][driving])) < most


@pytest.mark.parametrize("name", STOP)
def test_it_stops_as_the_plant_does_but_for_the_last_jolt(
    name: str, departures: tuple[Array, dict[str, Array], float]
) -> None:
    at, off, stop = departures
    assert np.max(np.abs(off[name][at >= stop])) < STOP[name]
    assert abs(off[name][-1]) < 2e-3
