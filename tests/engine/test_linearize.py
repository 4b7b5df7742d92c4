"""Steady states and eigenvalues compared with hand-written matrices, closed forms and finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.engine.linearize import steady
from vdyn_cli.engine.maths import sqrt
from vdyn_cli.engine.model import Model
from vdyn_cli.physics.models.half_car import LONGITUDINAL, half_car
from vdyn_cli.physics.models.longitudinal_hubs import STIFFEST
from vdyn_cli.physics.models.road_load import road_load
from vdyn_cli.quantities.errors import ResultError

CAR = {
    "mass": 1588.0,
    "sprung_pitch_inertia": 2000.0,
    "cg_to_front": 1.25,
    "wheelbase": 2.7,
    "unsprung_mass_front": 82.0,
    "unsprung_mass_rear": 75.0,
    "suspension_stiffness_front": 44e3,
    "suspension_stiffness_rear": 41e3,
    "suspension_damping_front": 3200.0,
    "suspension_damping_rear": 2900.0,
    "tire_vertical_stiffness": 4e5,
}
UNUSED = (
    "bump_height",
    "bump_width",
    "antenna_offset",
    "outboard_mass",
    *LONGITUDINAL,
    "distance_front",
    "speed_scale",
    "speed_ramp",
)
SHORT_OF_THE_BUMP = {"bump_height": 0.07, "bump_width": 0.48, "distance_front": 5.0}
ROAD = {
    "mass": 1500.0,
    "rotating_mass": 60.0,
    "rolling_resistance": 0.01,
    "rolling_speed": 0.0,
    "drag_area": 0.6,
    "air_density": 1.2,
    "wind_variance": 0.0,
    "gear_ratio": 3.0,
    "wheel_radius": 0.3,
    "driveline_efficiency": 0.95,
    "recuperation_loss": 1.0,
}


def half(**changed: float):
    parameters = {**dict.fromkeys(UNUSED, 0.0), **SHORT_OF_THE_BUMP, **CAR, **changed}
    return steady(half_car(), parameters, {"speed": 0.0, "elapsed": 0.0})


def by_hand(c: dict[str, float]) -> np.ndarray:
    """Eigenvalues with a positive imaginary part of M q'' + C q' + K q = 0 over (z, pitch, zf, zr)."""
    mf, mr = c["unsprung_mass_front"], c["unsprung_mass_rear"]
    ms = c["mass"] - mf - mr
    a = (c["mass"] * c["cg_to_front"] - mr * c["wheelbase"]) / ms
    b = c["wheelbase"] - a

    def coupled(f: float, r: float) -> np.ndarray:
        return np.array(
            [
                [f + r, a * f - b * r, -f, -r],
                [a * f - b * r, a * a * f + b * b * r, -a * f, b * r],
                [-f, -a * f, f, 0.0],
                [-r, b * r, 0.0, r],
            ]
        )

    inverse = np.diag(1.0 / np.array([ms, c["sprung_pitch_inertia"], mf, mr]))
    stiffness = coupled(c["suspension_stiffness_front"], c["suspension_stiffness_rear"])
    stiffness += np.diag([0.0, 0.0, c["tire_vertical_stiffness"], c["tire_vertical_stiffness"]])
    damping = coupled(c["suspension_damping_front"], c["suspension_damping_rear"])
    system = np.block([[np.zeros((4, 4)), np.eye(4)], [-inverse @ stiffness, -inverse @ damping]])
    roots = np.linalg.eigvals(system)
    return np.array(sorted(roots[roots.imag > 0], key=abs))


def test_the_half_cars_eigenvalues_are_those_of_its_matrices():
    state = half()
    resting, *roots, hub, other = state.roots  # the car rests at any position
    assert abs(resting.value) < 1e-9
    assert abs(hub.value) == pytest.approx(STIFFEST) == abs(other.value)  # rigid hubs stand apart from the rest
    np.testing.assert_allclose([root.value for root in roots], by_hand(CAR), rtol=1e-9)
    assert all(abs(value) < 1e-12 for name, value in state.states.items() if name != "position")


def test_the_slopes_of_eigenvalues_are_exact():
    roots = half().roots[1:-2]
    for name, value in CAR.items():
        step = 1e-5 * value
        ahead, behind = (by_hand({**CAR, name: value + sign * step}) for sign in (1, -1))
        slopes = [root.slopes[name] for root in roots]
        np.testing.assert_allclose(
            slopes, (ahead - behind) / (2 * step), rtol=1e-6, atol=1e-6 * abs(roots[0].value / value)
        )


def test_slopes_follow_the_steady_state_as_it_moves():
    def assemble(e, u):
        x = e.state("x", 1.0)
        e.integrate(x=u.push - e.p.drag * x**2)  # rests at sqrt(push / drag), where s = -2 sqrt(push drag)
        e.sensor("x", x)

    found = steady(Model("slows", assemble, ("drag",), ("push",)), {"drag": 0.5}, {"push": 8.0})
    assert found.states["x"] == pytest.approx(4.0, rel=1e-12)
    (root,) = found.roots
    assert root.value == pytest.approx(-4.0, rel=1e-12)
    assert root.slopes["drag"] == pytest.approx(-np.sqrt(8.0 / 0.5), rel=1e-10)


def test_a_cruise_takes_the_torque_that_the_road_load_says():
    inputs = {"grade": 0.02, "wind_speed": 1.0, "elapsed": 0.0, "drive_torque": 0.0}
    context = {"heading": 1.0, "temperature": 293.15}
    found = steady(road_load("torque"), ROAD, inputs, {"speed": 20.0}, ("drive_torque",), context)
    resistance = 0.36 * 21.0**2 + 1500 * 9.80665 * (0.01 + 0.02) / np.hypot(1.0, 0.02)
    assert found.inputs["drive_torque"] == pytest.approx(resistance * 0.3 / (0.95 * 3.0), rel=1e-12)
    assert found.states["speed"] == 20.0
    (root,) = found.roots
    assert root.value == pytest.approx(-2 * 0.36 * 21.0 / 1560.0, rel=1e-9)
    assert root.participation == {"speed": 1.0}


def test_participation_adds_up_and_the_largest_has_shape_one():
    for root in half().roots:
        assert sum(root.participation.values()) == pytest.approx(1.0)
        largest = max(root.participation, key=root.participation.__getitem__)
        assert root.shape[largest] == pytest.approx(1.0)


def test_where_nothing_is_steady_it_says_so():
    def assemble(e, u):
        x = e.state("x", 1.0)
        e.integrate(x=1.0 + sqrt(1.0 + x * x))
        e.sensor("x", x)

    with pytest.raises(ResultError, match="no steady state"):
        steady(Model("never", assemble, (), ()), {}, {})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"held": {"sped": 1.0}}, "did you mean 'speed'"),
        ({"free": ("drive_torqe",)}, "did you mean 'drive_torque'"),
        ({"inputs": {"grade": 0.0}}, "needs a value for wind_speed, elapsed, drive_torque"),
    ],
)
def test_names_that_do_not_fit_are_refused(change, message):
    inputs = dict.fromkeys(("grade", "wind_speed", "elapsed", "drive_torque"), 0.0)
    given = {"inputs": inputs, "held": {"speed": 20.0}, "free": ("drive_torque",), **change}
    with pytest.raises(ValueError, match=message):
        steady(road_load("torque"), ROAD, context={"heading": 1.0, "temperature": 293.15}, **given)
