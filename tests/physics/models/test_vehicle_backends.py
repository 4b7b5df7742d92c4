"""The vehicle in machine code and on the virtual machine: the same bits, and derivatives that agree."""

from __future__ import annotations

import numpy as np

from tests.physics.models.vehicle_cases import drive, parameters, pedals
from vdyn_cli.engine.simulate import Simulator
from vdyn_cli.physics.models.vehicle import vehicle

UNKNOWNS = ("mass", "rolling_resistance", "tire_B", "shaft_stiffness_left", "wheel_radius", "cg_height", "start.speed")


def test_both_backends_drive_alike_from_rest_to_rest():
    time = np.arange(0.0, 1.5, 1e-3)
    noise = np.random.default_rng(4).normal(0.0, 20.0, time.size)
    run = pedals(time, (0, 0, 0), (0.1, 250, 0), (0.7, 250, 0), (0.8, 0, 3500), (1.5, 0, 3500))
    trip = drive(time, **{**run, "drive_torque": run["drive_torque"] + noise})
    car = parameters()
    theta = [car.get(name, 0.0) for name in UNKNOWNS]
    fast, slow = (
        Simulator(vehicle(), car, UNKNOWNS, backend=name)(trip, theta, states=True) for name in ("llvm", "vm")
    )
    assert fast.outputs.keys() == slow.outputs.keys()
    for name, value in fast.outputs.items():
        assert np.array_equal(value, slow.outputs[name]), name
        apart = np.abs(fast.sensitivities[name] - slow.sensitivities[name]).max(axis=0)
        assert np.all(apart <= 1e-10 * np.abs(slow.sensitivities[name]).max(axis=0)), name
    assert all(np.array_equal(value, slow.states[name]) for name, value in fast.states.items())


def test_values_are_the_same_to_the_bit_with_and_without_derivatives():
    time = np.arange(0.0, 0.3, 1e-3)
    trip = drive(time, {"speed": 12.0}, drive_torque=200.0)
    car = parameters()
    alone = Simulator(vehicle(), car)(trip)
    beside = Simulator(vehicle(), car, ("mass", "tire_B"))(trip, [car["mass"], car["tire_B"]])
    assert all(np.array_equal(value, beside.outputs[name]) for name, value in alone.outputs.items())
