"""The full vehicle at its limits: at rest, on a road that half car and road load know, mirrored, moved, turned."""

from __future__ import annotations

import numpy as np
import pytest

from tests.physics.models.vehicle_cases import CONTEXT, CORNERS, Array, drive, parameters, pedals, simulate
from tests.physics.models.vehicle_energy import Account
from tests.plant.vehicle import GRAVITY, REFERENCE
from vdyn_cli.engine.simulate import Drive, Simulated, Simulator
from vdyn_cli.physics.models.half_car import GIVEN, LONGITUDINAL, SOUGHT, half_car
from vdyn_cli.physics.models.road_load import road_load
from vdyn_cli.physics.models.vehicle import vehicle
from vdyn_cli.physics.models.wheel_spin import WHEEL_SPIN
from vdyn_cli.quantities.vocabulary import PARAMETERS

SWAP = (("left", "right"), ("right", "left"))
SIDEWAYS = ("lateral_position", "lateral_speed", "yaw", "yaw_rate", "roll", "roll_rate")
GENTLE = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 250.0, 0.0), (8.0, 250.0, 0.0), (9.0, 0.0, 0.0), (12.0, 0.0, 0.0))


def clock(seconds: float, step: float = 1e-3) -> Array:
    return np.arange(round(seconds / step) + 1) * step


@pytest.fixture(scope="module")
def tipped_in() -> Simulated:
    time = clock(6.0)
    return simulate(drive(time, **pedals(time, (0, 0, 0), (0.5, 0, 0), (0.7, 400, 0), (3, 400, 0), (3.1, 0, 0))))


def test_at_rest_nothing_moves_and_the_loads_are_the_weight() -> None:
    found = simulate(drive(clock(1.0)))
    assert np.all(found.outputs["front_load"] == found.outputs["front_load"][0])
    assert found.outputs["front_load"][0] == pytest.approx(REFERENCE.front_load, rel=1e-14)
    assert found.outputs["rear_load"][0] == pytest.approx(REFERENCE.rear_load, rel=1e-14)
    assert not any(values.any() for name, values in found.states.items() if name != "run_time")


def test_held_on_a_slope_the_loads_shift_as_statics_say() -> None:
    # Tires that roll with friction keep, at rest, a moment that depends on how they stopped.
    found = simulate(drive(clock(15.0), brake_torque=5000.0, grade=0.1), {"rolling_resistance": 1e-9})
    slope, car = np.arctan(0.1), REFERENCE
    along, across = car.mass * GRAVITY * np.sin(slope), car.mass * GRAVITY * np.cos(slope)
    front = (across * car.cg_to_rear - along * car.cg_height) / car.wheelbase
    assert found.outputs["front_load"][-1] == pytest.approx(front, rel=1e-9)
    assert found.outputs["rear_load"][-1] == pytest.approx(across - front, rel=1e-9)
    assert found.outputs["acceleration"][-1] == pytest.approx(GRAVITY * np.sin(slope), rel=1e-9)


def test_under_power_the_loads_shift_by_height_spin_and_rolling() -> None:
    time = clock(30.0)
    found = simulate(drive(time, drive_torque=150.0), {"drag_area": 0.0})
    p, a = parameters(), found.outputs["acceleration"][-1]
    spin = 4 * p["wheel_inertia"] * np.gradient(found.outputs["wheel_speed_rl"], time)[-1]
    rolling = p["rolling_resistance"] * p["mass"] * GRAVITY * p["wheel_radius"]  # the road pushes ahead of the axle
    motor = p["motor_reaction"] * p["driveline_inertia"] * np.gradient(found.outputs["wheel_speed_fl"], time)[-1]
    moved = (p["mass"] * p["cg_height"] * a + spin + rolling + motor) / p["wheelbase"]
    assert REFERENCE.front_load - found.outputs["front_load"][-1] == pytest.approx(moved, rel=2e-3)


def road_load_speed(time: Array, torque: Array, car: dict[str, float]) -> Array:
    names = ("mass", "rolling_resistance", "rolling_speed", "drag_area", "air_density", "wind_variance")
    values = {n: car[n] for n in (*names, "gear_ratio", "wheel_radius", "driveline_efficiency", "recuperation_loss")}
    turning = 4 * car["wheel_inertia"] + car["driveline_inertia"]
    values["rotating_mass"] = turning / car["wheel_radius"] ** 2
    inputs = {"drive_torque": torque, "grade": 0.0, "wind_speed": 0.0, "elapsed": 0.0}
    run = Drive(time, inputs, {"speed": 2.0}, {}, CONTEXT)
    return Simulator(road_load("torque"), values)(run).outputs["speed"]


def test_a_stiff_car_drives_as_a_mass_on_the_road() -> None:
    """From 2 m/s: at the launch the vehicle sticks to the road, which the mass does not."""
    time = clock(12.0)
    inputs = pedals(time, *GENTLE)
    errors = []
    for stiffer in (1.0, 4.0):
        car = {"tire_B": 12.0 * stiffer, "tire_relaxation_length": 0.25 / stiffer}
        car |= {f"suspension_stiffness_{end}": 4e4 * stiffer for end in ("front", "rear")}
        car |= {f"shaft_stiffness_{side}": 2e4 * stiffer for side in ("left", "right")}
        found = simulate(drive(time, {"speed": 2.0}, **inputs), car)
        plain = road_load_speed(time, inputs["drive_torque"], parameters(**car))
        errors.append(np.max(np.abs(found.outputs["speed"] - plain)) / plain.max())
    assert errors[0] < 1e-3
    assert errors[1] < errors[0] / 3  # what is left is slip, and falls with it


def bump_heights(where: Array) -> Array:
    inside = (where > 0) & (where < 0.48)
    return np.where(inside, 0.035 * (1 - np.cos(2 * np.pi * where / 0.48)), 0.0)


def over_a_bump(time: Array, speed: float, wheels: tuple[str, ...], car: dict[str, float]) -> Simulated:
    way = speed * time
    heights = {"f": bump_heights(way - 1.0), "r": bump_heights(way - 1.0 - REFERENCE.wheelbase)}
    roads = {f"road_{at}": heights[at[0]] for at in wheels}
    return simulate(drive(time, {"speed": speed}, **roads), car)


# Hubs at the height of the center of gravity: pitching does not move them along, as in the half car.
LEVEL = {"cg_height": REFERENCE.wheel_radius, "rolling_resistance": 1e-9, "drag_area": 0.0}
LEVEL |= {"tire_vertical_damping": 0.0}


@pytest.fixture(scope="module")
def bumped() -> Simulated:
    return over_a_bump(clock(2.0, 5e-4), 15 / 3.6, CORNERS, LEVEL)


def test_over_a_straight_bump_it_is_the_half_car(bumped: Simulated) -> None:
    values = {n: float(getattr(REFERENCE, n)) for n in (*SOUGHT, *GIVEN) if hasattr(REFERENCE, n)}
    values |= {
        "sprung_pitch_inertia": REFERENCE.pitch_inertia,
        "antenna_offset": 0.0,
        "outboard_mass": 0.0,
        **dict.fromkeys(LONGITUDINAL, 0.0),
    }
    values |= {"bump_height": 0.07, "bump_width": 0.48, "distance_front": 1.0, "speed_scale": 0.0, "speed_ramp": 0.0}
    run = Drive(bumped.time, {"speed": 15 / 3.6, "elapsed": 0.0}, {"position": 0.0})
    half = Simulator(half_car(), values)(run)
    for name in ("front_load", "rear_load"):
        assert half.outputs[name].min() == 0.0  # the wheels leave the road
        assert np.max(np.abs(bumped.outputs[name] - half.outputs[name])) < 2e-3 * np.ptp(half.outputs[name]), name
    assert np.max(np.abs(bumped.states["pitch_rate"] - half.outputs["pitch_rate"])) < 1e-3


def test_wheels_leave_the_road_and_land(bumped: Simulated) -> None:
    for name in ("front_load", "rear_load"):
        load = bumped.outputs[name]
        assert load.min() == 0.0
        assert load[-1] > 0.5 * load[0]
    assert np.all(np.isfinite(bumped.outputs["jerk"]))


def test_a_wheel_spins_as_its_hub_s_forces_say() -> None:
    time = clock(5.0)
    inputs = pedals(time, (0, 0, 0), (0.5, 0, 0), (0.7, 300, 0), (3, 300, 0), (3.3, 0, 2000), (5, 0, 2000))
    found = simulate(drive(time, {"speed": 5.0}, **inputs))
    account = Account(found, parameters(), inputs["drive_torque"], inputs["brake_torque"], 0.0)
    mass, moving = 20.0, time < 3.8
    acceleration = found.outputs["acceleration"]
    hub = {
        "hub_torque": found.outputs["shaft_torque_right"] - inputs["brake_torque"] * 0.65 / 2,
        "hub_force_x": account.forward["fr"] - mass * acceleration,
        "hub_force_z": account.loads["fr"] - mass * GRAVITY,
        "acceleration": acceleration,
        "wheel_speed": found.outputs["wheel_speed_fr"],
    }
    values = {n: parameters()[n] for n in ("wheel_inertia", "wheel_radius", "rolling_resistance")}
    run = Drive(time[moving], {n: values[moving] for n, values in hub.items()})
    alone = Simulator(WHEEL_SPIN, {**values, "wheel_mass": mass, "hub_torque_zero": 0.0})(run, states=True)
    assert np.max(np.abs(alone.states["wheel_speed"] - found.outputs["wheel_speed_fr"][moving])) < 5e-3


def test_equal_sides_keep_it_straight(tipped_in: Simulated) -> None:
    inputs = pedals(tipped_in.time, (0, 0, 0), (0.5, 400, 0), (3, 0, 3000))
    car = {f"shaft_stiffness_{side}": 2e4 for side in ("left", "right")}
    same = simulate(
        drive(tipped_in.time, **inputs), car | {f"shaft_damping_{side}": 50.0 for side in ("left", "right")}
    )
    for name in SIDEWAYS:
        assert np.max(np.abs(same.states[name])) < 1e-12, name
        assert np.max(np.abs(tipped_in.states[name])) > 1e-9, name  # unequal half-shafts steer, a little


def test_a_mirrored_car_drives_the_mirrored_way(tipped_in: Simulated) -> None:
    p = parameters()
    swapped = {f"shaft_{kind}_{a}": p[f"shaft_{kind}_{b}"] for kind in ("stiffness", "damping") for a, b in SWAP}
    inputs = pedals(tipped_in.time, (0, 0, 0), (0.5, 0, 0), (0.7, 400, 0), (3, 400, 0), (3.1, 0, 0))
    mirrored = simulate(drive(tipped_in.time, **inputs), swapped)
    for name in SIDEWAYS:
        size = np.max(np.abs(tipped_in.states[name]))
        assert np.max(np.abs(mirrored.states[name] + tipped_in.states[name])) < 1e-6 * size, name
    for name in ("speed", "jerk", "front_load"):
        assert mirrored.outputs[name] == pytest.approx(tipped_in.outputs[name], rel=1e-9, abs=1e-9)
    other = mirrored.outputs["shaft_torque_right"]
    assert other == pytest.approx(tipped_in.outputs["shaft_torque_left"], rel=1e-9, abs=1e-7)


def test_it_does_not_matter_where_it_starts_which_way_it_faces_and_how_high(tipped_in: Simulated) -> None:
    inputs = pedals(tipped_in.time, (0, 0, 0), (0.5, 0, 0), (0.7, 400, 0), (3, 400, 0), (3.1, 0, 0))
    roads = {f"road_{at}": 0.25 for at in CORNERS}
    start = {"position": 1e3, "lateral_position": -40.0, "yaw": 2.0}
    moved = simulate(drive(tipped_in.time, start, **inputs, **roads))
    for name, values in tipped_in.outputs.items():
        assert moved.outputs[name] == pytest.approx(values, rel=1e-9, abs=1e-6), name
    x, y = tipped_in.states["position"], tipped_in.states["lateral_position"]
    assert moved.states["position"] == pytest.approx(1e3 + x * np.cos(2.0) - y * np.sin(2.0), abs=1e-9)
    assert moved.states["lateral_position"] == pytest.approx(-40.0 + x * np.sin(2.0) + y * np.cos(2.0), abs=1e-9)
    assert moved.states["heave"] - 0.25 == pytest.approx(tipped_in.states["heave"], abs=1e-12)


def test_a_moving_start_rolls_freely() -> None:
    found = simulate(drive(clock(0.2), {"speed": 20.0}))
    p = parameters()
    expected = -(0.5 * 1.225 * p["drag_area"] * 400 + p["rolling_resistance"] * p["mass"] * GRAVITY)
    assert found.outputs["wheel_speed_rl"][0] == pytest.approx(20.0 / p["wheel_radius"])
    inertia = p["mass"] + (4 * p["wheel_inertia"] + p["driveline_inertia"]) / p["wheel_radius"] ** 2
    assert np.ptp(found.outputs["speed"]) / 0.2 == pytest.approx(-expected / inertia, rel=0.05)


@pytest.mark.slow
def test_torques_of_the_sides_are_those_of_the_axle(tipped_in: Simulated) -> None:
    """With half-shafts alike the side gears stand still against each other, as do two motors."""
    alike = {
        "shaft_stiffness_right": REFERENCE.shaft_stiffness_left,
        "shaft_damping_right": REFERENCE.shaft_damping_left,
    }
    p = parameters() | alike
    torque = pedals(tipped_in.time, (0, 0, 0), (0.5, 0, 0), (0.7, 400, 0), (3, 400, 0), (3.1, 0, 0))["drive_torque"]
    sides = {f"drive_torque_{side}": torque * p["gear_ratio"] / 2 for side in ("left", "right")}
    model = vehicle("front", "sides")
    run = drive(tipped_in.time)
    inputs = {n: v for n, v in run.inputs.items() if n in model.inputs} | sides
    found = Simulator(model, {n: p[n] for n in model.parameters})(Drive(run.time, inputs, {}, {}, CONTEXT))
    for name, values in simulate(drive(tipped_in.time, drive_torque=torque), alike).outputs.items():
        assert found.outputs[name] == pytest.approx(values, rel=1e-9, abs=1e-9), name
    assert set(vehicle("both", "sides").inputs) == set(model.inputs)


@pytest.mark.parametrize("driven", ["rear", "both"])
def test_any_axle_may_drive(driven: str, tipped_in: Simulated) -> None:
    inputs = pedals(tipped_in.time, (0, 0, 0), (0.5, 0, 0), (0.7, 400, 0), (3, 400, 0), (3.1, 0, 0))
    found = simulate(drive(tipped_in.time, **inputs), driven=driven)
    assert found.outputs["speed"][-1] == pytest.approx(tipped_in.outputs["speed"][-1], rel=5e-3)
    at = int(np.searchsorted(found.time, 2.9))
    share = {"rear": 2, "both": 4}[driven]
    full = 400 * REFERENCE.gear_ratio / share
    assert 0.85 * full < found.outputs["shaft_torque_left"][at] < full
    slip = found.outputs["wheel_speed_rl"][at] * REFERENCE.wheel_radius / found.outputs["speed"][at] - 1
    assert slip > 5e-3  # the rear wheels push


def test_every_parameter_moves_something() -> None:
    time = clock(4.0, 2e-3)
    inputs = pedals(time, (0, 0, 0), (0.2, 400, 0), (2, 400, 0), (2.2, -100, 3000), (4, -100, 3000))
    way = {"wind_speed": 3.0, "grade": 0.02, "road_fl": bump_heights(10 * time - 5.0)}
    run = drive(time, {"speed": 10.0}, **way, **inputs)
    for model in (vehicle("front"), vehicle("both")):
        values = parameters(wind_variance=0.3, rolling_speed=1e-5, driveline_efficiency=0.95)
        found = Simulator(model, values, model.parameters, substeps=2)(run, [values[n] for n in model.parameters])
        moved = sum(np.abs(s).max(axis=0) / np.abs(found.outputs[n]).max() for n, s in found.sensitivities.items())
        for k, name in enumerate(model.parameters):
            assert abs(moved[k] * (values[name] or 1.0)) > 1e-9, name


def test_every_parameter_has_a_name_in_the_vocabulary() -> None:
    inner = {"rolling_speed", "wind_variance"}
    assert set(vehicle().parameters) - inner <= set(PARAMETERS)
