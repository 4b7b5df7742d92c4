"""The vehicle's eigenmodes against its limits: the half car, a shaft between two inertias; their names and slopes."""

from __future__ import annotations

import math
from functools import cache

import pytest

from tests.engine.test_linearize import by_hand
from tests.physics.models.vehicle_cases import parameters
from vdyn_cli.physics.models.vibration_modes import Mode, cruise, modes
from vdyn_cli.quantities.errors import ResultError

BODY = ("bounce", "pitch", "roll")
HOPS = (
    "wheel hop front",
    "wheel hop rear",
    "wheel hop front, against each other",
    "wheel hop rear, against each other",
)


@cache
def table(
    speed: float, driven: str = "front", changed: tuple[tuple[str, float], ...] = (), differential: str = "open"
) -> dict[str, Mode]:
    found = modes(parameters(**dict(changed)), speed, driven, differential)  # type: ignore[arg-type]
    assert len({mode.name for mode in found}) == len(found)
    return {mode.name: mode for mode in found}


@pytest.mark.parametrize("speed", [2.0, 20.0, 40.0])
@pytest.mark.parametrize("driven", ["front", "rear", "both"])
@pytest.mark.parametrize("differential", ["open", "locked"])
def test_every_motion_has_its_mode_and_each_differential_one_shuffle(speed, driven, differential):
    found = table(speed, driven, (), differential)
    assert {*BODY, *HOPS} <= found.keys()
    shuffles = [name for name in found if "shuffle" in name]
    both = ["driveline shuffle front", "driveline shuffle rear"]
    assert sorted(shuffles) == (both if driven == "both" else ["driveline shuffle"])
    assert sum("tire slip" in name for name in found) == 4
    assert all(mode.damping > 0 for mode in found.values())
    frequencies = [mode.frequency for mode in found.values()]
    assert frequencies == sorted(frequencies)


def test_bounce_and_hops_are_the_half_cars():
    car = parameters(tire_vertical_damping=0.0)
    half = by_hand({**car, "sprung_pitch_inertia": car["pitch_inertia"]})
    found = table(20.0, "front", (("tire_vertical_damping", 0.0),))
    for name, root in zip(("bounce", "pitch", "wheel hop front", "wheel hop rear"), half, strict=True):
        # What pulls at the road pitches the body, which the half car does not know.
        close = 0.03 if name == "pitch" else 0.003
        assert found[name].frequency == pytest.approx(abs(root) / (2 * math.pi), rel=close), name
        assert found[name].damping == pytest.approx(-root.real / abs(root), rel=2 * close), name


def test_on_stiff_tires_the_driveline_swings_on_its_shafts_alone():
    stiff = {"tire_B": 4000.0, "tire_relaxation_length": 0.02}
    shafts = {"shaft_stiffness_left": 2e4, "shaft_stiffness_right": 2e4, "shaft_damping_left": 5.0}
    car = parameters(**stiff, **shafts, shaft_damping_right=5.0)
    found = {mode.name: mode for mode in modes(car, 3.0)}
    inner = car["driveline_inertia"]
    outer = car["mass"] * car["wheel_radius"] ** 2 + 4 * car["wheel_inertia"]
    closed = math.sqrt(4e4 * (1 / inner + 1 / outer)) / (2 * math.pi)
    assert found["driveline shuffle"].frequency == pytest.approx(closed, rel=0.01)


def test_unlike_shafts_of_an_open_differential_swing_as_one_shaft_of_their_compliances():
    """Equal torques twist the softer one more: 1/k = (1/kl + 1/kr) / 4 between carrier and car; locked, k = kl + kr."""
    stiff = {"tire_B": 4000.0, "tire_relaxation_length": 0.02, "shaft_damping_left": 5.0, "shaft_damping_right": 5.0}
    car = parameters(**stiff, shaft_stiffness_left=3e4, shaft_stiffness_right=1.2e4)
    inner, outer = car["driveline_inertia"], car["mass"] * car["wheel_radius"] ** 2 + 4 * car["wheel_inertia"]
    for differential, stiffness in (("open", 4 / (1 / 3e4 + 1 / 1.2e4)), ("locked", 4.2e4)):
        found = {mode.name: mode for mode in modes(car, 3.0, "front", differential)}
        closed = math.sqrt(stiffness * (1 / inner + 1 / outer)) / (2 * math.pi)
        assert found["driveline shuffle"].frequency == pytest.approx(closed, rel=0.01), differential


def test_the_softer_shaft_moves_the_shuffle_more():
    shuffle = table(15.0)["driveline shuffle"]
    slopes, p = shuffle.frequency_slopes, parameters()
    ratio = p["shaft_stiffness_left"] / p["shaft_stiffness_right"]
    assert slopes["shaft_stiffness_right"] / slopes["shaft_stiffness_left"] == pytest.approx(ratio, rel=0.1)


@pytest.mark.parametrize("name", ["mass", "shaft_stiffness_left", "tire_D", "suspension_damping_front", "wheel_radius"])
def test_slopes_are_those_of_the_table(name):
    value, middle = parameters()[name], table(15.0)
    ahead, behind = (table(15.0, "front", ((name, value * (1 + sign * 1e-4)),)) for sign in (1, -1))
    for mode in ("bounce", "pitch", "driveline shuffle", "tire slip front", "wheel hop front"):
        for slope, quantity in (("frequency_slopes", "frequency"), ("damping_slopes", "damping")):
            difference = (getattr(ahead[mode], quantity) - getattr(behind[mode], quantity)) / 2e-4
            size = getattr(middle[mode], quantity)
            assert getattr(middle[mode], slope)[name] == pytest.approx(difference, rel=1e-4, abs=1e-5 * size), mode


def test_the_parameters_that_move_a_mode_most_are_reported_first():
    movers = table(15.0)["wheel hop front"].frequency_movers(2)
    assert {name for name, _ in movers} == {"tire_vertical_stiffness", "unsprung_mass_front"}
    assert abs(movers[0][1]) >= abs(movers[1][1])
    assert table(15.0)["bounce"].damping_movers(1)[0][0].startswith("suspension_damping")


def test_a_cruise_is_steady():
    state = cruise(parameters(), 25.0)
    car = parameters()
    drag = 0.5 * car["air_density"] * car["drag_area"] * 25.0**2
    rolling = car["rolling_resistance"] * car["mass"] * 9.80665
    # Slip costs a little more than what the road load takes.
    power = state.inputs["drive_torque"] * car["gear_ratio"] / car["wheel_radius"]
    assert power == pytest.approx(drag + rolling, rel=2e-3)
    assert state.states["yaw_rate"] == pytest.approx(0.0, abs=1e-9)


def test_a_speed_that_no_tire_can_hold_has_no_modes():
    with pytest.raises(ResultError, match="no steady state"):
        modes(parameters(), 300.0)
