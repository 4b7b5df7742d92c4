"""The driven axle: an open differential shares the torque equally, a locked one holds both sides to one speed."""

from __future__ import annotations

import numpy as np
import pytest

from tests.physics.models.vehicle_cases import drive, parameters, pedals, simulate
from tests.plant import drive as plant
from tests.plant.shaft import drawing
from tests.plant.vehicle import REFERENCE, Vehicle, random_vehicle
from vdyn_cli.engine.graph import trace
from vdyn_cli.engine.simulate import Simulated
from vdyn_cli.physics.models.vehicle import vehicle

TIME = np.arange(6001) * 1e-3
FOOT = pedals(TIME, (0, 0, 0), (0.5, 0, 0), (0.55, 400, 0), (2, 400, 0), (2.05, -60, 0), (3, -60, 0), (3.05, 400, 0))
PLANT = {"shaft_torque_left": "Shaft Torque Left [N m]", "shaft_torque_right": "Shaft Torque Right [N m]"}


def tipped_in(differential: str, **changed: float) -> Simulated:
    return simulate(drive(TIME, {"speed": 3.0}, **FOOT), changed, differential=differential)


def apart(found: Simulated) -> float:
    """The largest difference of the half-shafts' torques over the largest torque."""
    left, right = (found.outputs[f"shaft_torque_{side}"] for side in ("left", "right"))
    return float(np.max(np.abs(left - right)) / np.max(np.abs(left)))


@pytest.mark.parametrize("damping", [1.0, 0.1, 5.0])
def test_an_open_differential_shares_the_torque_equally_in_a_sharp_tip_in(damping: float) -> None:
    shafts = {f"shaft_damping_{side}": damping * parameters()[f"shaft_damping_{side}"] for side in ("left", "right")}
    assert apart(tipped_in("open", **shafts)) < 0.02
    assert apart(tipped_in("locked", **shafts)) > 0.1


def test_unequal_shafts_part_the_side_gears_and_leave_a_locked_differential_together() -> None:
    """The twists differ as the stiffnesses do; locked, the torques do."""
    p, held = parameters(), (TIME > 1.6) & (TIME < 2.0)
    for differential, quantity in (("open", "twist"), ("locked", "torque")):
        found = tipped_in(differential)
        names = ("twist_fl", "twist_fr") if quantity == "twist" else ("shaft_torque_left", "shaft_torque_right")
        left, right = (np.mean({**found.states, **found.outputs}[name][held]) for name in names)
        if quantity == "twist":
            ratio = p["shaft_stiffness_right"] / p["shaft_stiffness_left"]
            assert left / right == pytest.approx(ratio, rel=0.01)
        else:
            assert left > right  # the stiffer one carries more, as far as the tires let it
    assert "side_gear_speed_front" not in found.states


def test_the_body_is_turned_back_by_the_whole_drive_torque_of_a_motor_at_wheel_speed() -> None:
    """What spins the rotor up pitches the body in proportion to motor_reaction; at rest nothing does."""
    run = drive(TIME, {"speed": 3.0}, drive_torque=np.interp(TIME, [0.2, 0.4], [0.0, 200.0]))
    free, whole = (simulate(run, {"motor_reaction": share}) for share in (0.0, 1.0))
    spun = parameters()["driveline_inertia"] * np.gradient(whole.outputs["wheel_speed_fl"], TIME)
    moved = (free.outputs["front_load"] - whole.outputs["front_load"]) * parameters()["wheelbase"]
    assert moved[-1] == pytest.approx(spun[-1], rel=0.02)
    assert np.max(np.abs(moved[TIME < 0.1])) < 0.1 * spun[-1]


@pytest.mark.parametrize("seed", [3, pytest.param(8, marks=pytest.mark.slow)])
def test_locked_it_drives_as_the_locked_plant_does(seed: int) -> None:
    car: Vehicle = random_vehicle(seed).but(differential_locked=True)
    plan = plant.pedals(car, seed)[0]
    (true,) = plant.noise_free(car, [plan])
    time = np.arange(0.0, plan.knots[-1], 1e-3)
    inputs = {"drive_torque": plan.drive, "brake_torque": plan.brake}
    run = drive(time, **{n: np.interp(time, plan.knots, v) for n, v in inputs.items()})
    locked, opened = (simulate(run, parameters(car), differential=kind) for kind in ("locked", "open"))
    driving = true["Speed [km/h]"] > 3.0  # m/s: at the launch the plant's brakes let go in another way
    for name, column in PLANT.items():
        off, wrong = (
            (np.interp(true["Time [s]"], time, found.outputs[name]) - true[column])[driving]
            for found in (locked, opened)
        )
        assert np.sqrt(np.mean(off**2)) < 0.7, name
        assert np.sqrt(np.mean(wrong**2)) > 2.0, name


@pytest.mark.parametrize(
    ("driven", "torque", "differential", "count"),
    [
        ("front", "axle", "open", 16),
        ("rear", "axle", "locked", 15),
        ("both", "axle", "open", 18),
        ("front", "sides", "open", 16),
    ],
)
def test_degrees_of_freedom_are_the_states_that_are_positions(
    driven: str, torque: str, differential: str, count: int
) -> None:
    """A speed that is integrated to a position or an angle, wheels' turning included, is a degree of freedom.

    Body 6, suspensions 4, wheels' spin 4, and the half-shafts' inner ends: 2 of an axle, 1 if they are locked together.
    An open carrier turns at their mean. SAE 2017-01-1574 counts 18, with a second twist in each half-shaft: a mass
    within the stepped bar, whose frequency is far above what a step can follow (below).
    """
    states = trace(vehicle(driven, torque, differential=differential)).states  # type: ignore[arg-type]
    body = ("speed", "lateral_speed", "heave_rate", "pitch_rate", "roll_rate", "yaw_rate")
    others = ("wheel_rate_", "wheel_speed_", "inner_speed_", "carrier_speed_", "side_gear_speed_")
    assert sum(name in body or name.startswith(others) for name in states) == count


def test_a_stepped_bar_turns_about_itself_far_above_what_a_step_can_follow() -> None:
    """The first torsional frequency of the sample's half-shafts, ends held, by finite elements of 1 mm."""
    for side, expected in (("left", 3770.0), ("right", 1999.0)):
        sections = drawing(REFERENCE, side)
        diameters = np.concatenate(
            [np.tile([[s.outer_diameter], [s.inner_diameter]], round(s.length / 1e-3)) for s in sections], axis=1
        )
        polar = np.pi / 32 * (diameters[0] ** 4 - diameters[1] ** 4)
        stiffness, inertia = REFERENCE.shear_modulus * polar / 1e-3, 7850.0 * polar * 1e-3
        middle = (inertia[:-1] + inertia[1:]) / 2
        bound = np.diag(stiffness[:-1] + stiffness[1:]) - np.diag(stiffness[1:-1], 1) - np.diag(stiffness[1:-1], -1)
        lowest = np.sqrt(np.min(np.linalg.eigvals(bound / middle[:, None]).real)) / (2 * np.pi)
        assert lowest == pytest.approx(expected, rel=0.01)
        assert inertia.sum() < 2e-3 * REFERENCE.wheel_inertia
