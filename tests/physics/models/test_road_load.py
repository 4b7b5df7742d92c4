"""The car on the road against closed forms, and the numbers of the paper."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from vdyn_cli.effects import candidates
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.physics.models.road_load import road_load
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.coastdown.fit.reference_conditions import RoadLoad
from vdyn_cli.steps.coastdown.spec import CoastdownSpec
from vdyn_cli.steps.coastdown.step import STEP

Array = NDArray[np.float64]

GRAVITY = 9.80665
PAPER = {"mass": 1588.0, "rolling_resistance": 0.014, "drag_area": 0.25 * 2.19, "air_density": 1.225}
NOTHING = {"rotating_mass": 0.0, "rolling_speed": 0.0, "wind_variance": 0.0}
TORQUE = {"gear_ratio": 3.267, "wheel_radius": 0.308, "driveline_efficiency": 1.0, "recuperation_loss": 0.0}


def simulate(time: Array, start: float, **changed: float | Array) -> Array:
    inputs = {"grade": 0.0, "wind_speed": 0.0, "elapsed": time}
    inputs |= {n: changed.pop(n) for n in list(changed) if n in ("grade", "wind_speed", "drive_torque", "drive_force")}
    driven = "torque" if "drive_torque" in inputs else "force" if "drive_force" in inputs else "coasting"
    parameters = {**PAPER, **NOTHING, **(TORQUE if driven == "torque" else {}), **changed}
    drive = Drive(time, inputs, {"speed": start}, context={"heading": 1.0, "temperature": 293.15})
    return Simulator(road_load(driven), parameters)(drive).outputs["speed"]


def closed_form(time: Array, start: float, inertia: float) -> Array:
    """V(t) = sqrt(a/b) tan(atan(V0 sqrt(b/a)) - sqrt(a b) t)."""
    a = PAPER["rolling_resistance"] * GRAVITY * PAPER["mass"] / inertia
    b = PAPER["air_density"] * PAPER["drag_area"] / (2 * inertia)
    return np.sqrt(a / b) * np.tan(np.arctan(start * np.sqrt(b / a)) - np.sqrt(a * b) * time)


@pytest.mark.parametrize("rotating_mass", [0.0, 87.5])
def test_a_coast_follows_the_closed_form(rotating_mass: float) -> None:
    time = np.arange(0.0, 100.0, 0.1)
    exact = closed_form(time, 70 / 3.6, 1588.0 + rotating_mass)
    assert np.allclose(simulate(time, 70 / 3.6, rotating_mass=rotating_mass), exact, atol=1e-9)


def test_the_papers_numbers_take_71_6_seconds_from_70_to_25_km_h() -> None:
    time = np.arange(0.0, 80.0, 0.1)
    speed = simulate(time, 70 / 3.6)
    assert np.interp(-25 / 3.6, -speed, time) == pytest.approx(71.6, abs=0.05)


def test_drive_force_headwind_and_slope_act_as_newton_says() -> None:
    time = np.linspace(0.0, 1e-3, 2)

    def acceleration(**inputs: float) -> float:
        return float(np.diff(simulate(time, 20.0, **inputs))[0] / 1e-3)

    calm = acceleration()
    drag = 0.5 * 1.225 * PAPER["drag_area"]
    assert acceleration(drive_force=1588.0) - calm == pytest.approx(1.0, rel=1e-4)
    assert acceleration(drive_torque=100.0) - calm == pytest.approx(100 * 3.267 / 0.308 / 1588.0, rel=1e-4)
    assert acceleration(wind_speed=3.0) - calm == pytest.approx(-drag * (23.0**2 - 20.0**2) / 1588.0, rel=1e-3)
    slope = np.arctan(0.05)
    uphill = -GRAVITY * np.sin(slope) + PAPER["rolling_resistance"] * GRAVITY * (1 - np.cos(slope))
    assert acceleration(grade=0.05) - calm == pytest.approx(uphill, rel=1e-4)


def test_gusts_add_their_variance_to_the_mean_drag() -> None:
    time = np.linspace(0.0, 1e-3, 2)
    gusty, calm = (np.diff(simulate(time, 20.0, wind_variance=v))[0] / 1e-3 for v in (4.0, 0.0))
    assert gusty - calm == pytest.approx(-0.5 * 1.225 * PAPER["drag_area"] * 4.0 / 1588.0, rel=1e-3)


def test_friction_does_not_turn_where_the_simulated_speed_falls_below_zero() -> None:
    """The runs hold only a car that rolls: at a jump of its slope, an error would count a thousand times."""
    time = np.arange(0.0, 20.0, 0.05)
    speed = simulate(time, 1.0)
    assert speed[-1] < -0.5
    steady = -PAPER["rolling_resistance"] * GRAVITY * 0.05
    assert np.diff(speed) == pytest.approx(np.full(time.size - 1, steady), rel=0.05)


def test_specific_force_is_blind_to_slope_but_for_the_turning_parts() -> None:
    """f = (F - Fd - Rr)/(M + mr) + g sin(grade) mr/(M + mr)."""
    time = np.arange(0.0, 2.0, 0.1)
    parameters = {**PAPER, **NOTHING, "rotating_mass": 88.0, "accelerometer_zero": 0.02}
    parameters |= {"accelerometer_scale": 0.0, "road_slope": 0.0}
    simulator = Simulator(road_load("coasting", accelerometer=True), parameters)
    context = {"heading": 0.0, "temperature": 293.15}

    def force(grade: float) -> float:
        drive = Drive(time, {"grade": grade, "wind_speed": 0.0, "elapsed": time, "speed": 20.0}, context=context)
        return float(simulator(drive).outputs["acceleration"][0])

    assert force(0.03) - force(0.0) == pytest.approx(GRAVITY * 0.03 * 88.0 / 1676.0, rel=0.01)


@pytest.mark.parametrize(
    ("resistances", "rolling", "drag"), [("coefficients", 1.1, 1.0), ("forces", 1.0, 1.0), ("coasted", 1.1, 1.1)]
)
def test_a_wrong_mass_changes_only_the_forces_that_depend_on_it(resistances, rolling, drag) -> None:
    """(M + mr) V' = -Rr - Fd: 10 % more mass, with each force multiplied by what the way of stating it requires."""
    model = road_load(resistances=resistances)
    values = {**PAPER, **NOTHING, "rotating_mass": 40.0, "mass_error": 0.1}
    context = {"heading": 0.0, "temperature": 293.15}
    inputs = {"grade": 0.0, "wind_speed": 0.0, "elapsed": 0.0}
    drive = Drive(np.linspace(0.0, 1e-3, 2), inputs, {"speed": 20.0}, context=context)
    (effect,) = [one for one in candidates() if one.name == "mass_error"]
    speed = Simulator(model, values, effects=(effect,))(drive).outputs["speed"]
    tires = PAPER["rolling_resistance"] * PAPER["mass"] * GRAVITY
    air = 0.5 * PAPER["air_density"] * PAPER["drag_area"] * 400.0
    rate = -(rolling * tires + drag * air) / (1.1 * PAPER["mass"] + 40.0)
    assert np.diff(speed)[0] / 1e-3 == pytest.approx(rate, rel=1e-4)


def test_a_load_adds_rolling_resistance_only_to_a_road_load_in_newtons() -> None:
    """(M + q + mr) V' = -(1 + q/M) Rr - Fd; per weight, a wrong mass is the same."""
    (effect,) = [one for one in candidates() if one.name == "payload"]
    assert not applicable(road_load(), [effect])
    model, load = road_load(resistances="forces"), 150.0
    assert applicable(model, [effect])
    values = {**PAPER, **NOTHING, "rotating_mass": 40.0, "payload": load}
    context = {"heading": 0.0, "temperature": 293.15}
    inputs = {"grade": 0.0, "wind_speed": 0.0, "elapsed": 0.0}
    drive = Drive(np.linspace(0.0, 1e-3, 2), inputs, {"speed": 20.0}, context=context)
    speed = Simulator(model, values, effects=(effect,))(drive).outputs["speed"]
    mass = PAPER["mass"] + load
    air = 0.5 * PAPER["air_density"] * PAPER["drag_area"] * 400.0
    rate = -(PAPER["rolling_resistance"] * mass * GRAVITY + air) / (mass + 40.0)
    assert np.diff(speed)[0] / 1e-3 == pytest.approx(rate, rel=1e-4)


@pytest.mark.parametrize("resistances", ["coefficients", "forces", "coasted"])
def test_a_wrong_rolling_resistance_changes_its_force_only(resistances) -> None:
    """(M + mr) V' = -(1 + e) Rr - Fd."""
    (effect,) = [one for one in candidates() if one.name == "rolling_error"]
    values = {**PAPER, **NOTHING, "rotating_mass": 40.0, "rolling_error": -0.3}
    inputs, context = {"grade": 0.0, "wind_speed": 0.0, "elapsed": 0.0}, {"heading": 0.0, "temperature": 293.15}
    drive = Drive(np.linspace(0.0, 1e-3, 2), inputs, {"speed": 20.0}, context=context)
    speed = Simulator(road_load(resistances=resistances), values, effects=(effect,))(drive).outputs["speed"]
    air = 0.5 * PAPER["air_density"] * PAPER["drag_area"] * 400.0
    rate = -(0.7 * PAPER["rolling_resistance"] * PAPER["mass"] * GRAVITY + air) / (PAPER["mass"] + 40.0)
    assert np.diff(speed)[0] / 1e-3 == pytest.approx(rate, rel=1e-4)


LBF, MPH = 4.4482216152605, 0.44704  # N, m/s
EPA = RoadLoad(22.883 * LBF, -0.15919 * LBF / MPH, 0.020143 * LBF / MPH**2)  # the paper's car on the EPA's list
MASS = 1587.6


def epa_coast() -> tuple[Array, Array]:
    """70 to 25 km/h under the EPA's polynomial, by an integrator of its own."""
    end = lambda t, v: v[0] - 25 / 3.6  # noqa: E731
    end.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(lambda t, v: -EPA.force(v) / MASS, (0, 300), [70 / 3.6], events=end, rtol=1e-9, dense_output=True)
    time = np.arange(0.0, found.t[-1], 0.1)
    return time, found.sol(time)[0]


def test_the_epa_curve_takes_127_seconds_and_130_with_its_turning_parts() -> None:
    assert epa_coast()[0][-1] == pytest.approx(126.6, abs=0.1)
    assert epa_coast()[0][-1] * 1.027 == pytest.approx(130, abs=0.1)


def test_the_papers_method_on_the_epa_curve() -> None:
    """Plain least squares, Cd fixed at 0.25: the paper's 0.014 carries some 115 N that are no tire's."""
    time, speed = epa_coast()
    given = {"mass": MASS, "rotating_mass": 0.0, "frontal_area": 2.19, "air_density": 1.225}
    known = Parameters({n: Estimate.given(PARAMETERS[n], v) for n, v in given.items()})
    runs = [{"log": f"{k}.csv", "direction": way} for k, way in enumerate(("out", "back"))]
    settings = {"speed_window": ["70 km/h", "25 km/h"], "fix": {"drag_coefficient": 0.25}, "noise": "white"}
    spec = CoastdownSpec.model_validate({"test": "coastdown", "runs": runs, "settings": settings})
    result = STEP.estimate(spec, [Log(f"{k}.csv", time, {"speed": speed}) for k in range(2)], known)
    assert 0.0063 <= result.parameters["rolling_resistance"].value <= 0.0066
    assert result.parameters["drag_coefficient"].value == pytest.approx(0.25)
