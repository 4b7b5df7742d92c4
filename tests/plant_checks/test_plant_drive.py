"""The truth plant's validation drives: rest, energy, limits, symmetry, and what each hidden effect does to a drive."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.plant import drive
from tests.plant.drive_motion import EFFECTS, Drive, Pedals, Trip
from tests.plant.sensors import Array
from tests.plant.vehicle import AIR_DENSITY, GRAVITY, REFERENCE

pytestmark = pytest.mark.slow  # checks the plant, not the program

WEIGHT = REFERENCE.mass * GRAVITY
# Rest, drive, back out, coast, brake, rest: the shortest that has everything.
SHORT = Pedals(
    (0.0, 1.0, 1.3, 6.0, 6.2, 10.0, 10.3, 14.0, 15.0), (0, 0, 300, 300, 0, 0, 0, 0, 0), (0,) * 6 + (1500.0,) * 3
)
TIMES = np.arange(0.0, 15.0, 0.01)
COAST, PULL = (TIMES > 7.0) & (TIMES < 9.5), (TIMES > 3.0) & (TIMES < 6.0)


@cache
def plain() -> Trip:
    """The drive without effects, simulated once."""
    return Drive(REFERENCE, SHORT).travel(TIMES)


def travel(effects: dict[str, float], pedals: Pedals = SHORT) -> Trip:
    return Drive(REFERENCE, pedals, effects).travel(TIMES)


def test_it_stands_before_and_after() -> None:
    assert np.max(np.abs(plain().speed[TIMES < 1.0])) < 1e-9
    assert abs(plain().speed[-1]) < 1e-3
    assert np.all(np.isfinite(plain().shaft_torque))


def test_coasting_is_the_road_load_of_the_car_with_its_rotating_mass() -> None:
    speed = plain().speed[COAST].mean()
    load = REFERENCE.rolling_resistance * WEIGHT + 0.5 * AIR_DENSITY * REFERENCE.drag_area * speed**2
    expected = -load / (REFERENCE.mass + REFERENCE.rotating_mass)
    assert plain().acceleration[COAST].mean() == pytest.approx(expected, rel=2e-3)


def test_driving_work_is_kinetic_energy_drag_rolling_and_slip() -> None:
    part = TIMES < 6.0
    t, v, w = TIMES[part], plain().speed[part], plain().wheel_speed[:, part]
    inner = (w[0] + w[1]) / 2  # the shafts' twist stores little
    torque = np.interp(t, SHORT.knots, SHORT.drive) * REFERENCE.gear_ratio
    work = np.trapezoid(torque * inner, t)
    kinetic = 0.5 * REFERENCE.mass * v[-1] ** 2 + 0.5 * REFERENCE.wheel_inertia * np.sum(w[:, -1] ** 2)
    kinetic += 0.5 * REFERENCE.driveline_inertia * inner[-1] ** 2
    drag = np.trapezoid(0.5 * AIR_DENSITY * REFERENCE.drag_area * v**3, t)
    rolling = np.trapezoid(REFERENCE.rolling_resistance * WEIGHT / 4 * w.sum(axis=0) * REFERENCE.wheel_radius, t)
    ends = np.array([w[0], w[1]])
    pull = plain().shaft_torque[:, part] - REFERENCE.wheel_inertia * np.gradient(ends, t, axis=1)
    pull = pull / REFERENCE.wheel_radius
    slipping = np.trapezoid(np.sum(pull * (ends * REFERENCE.wheel_radius - v), axis=0), t)
    assert work == pytest.approx(kinetic + drag + rolling + slipping, rel=3e-3)


def test_the_shafts_carry_the_torque_less_what_spins_up_their_ends() -> None:
    spinning = np.gradient(plain().wheel_speed[0], TIMES)[PULL].mean()
    expected = 0.5 * 300 * REFERENCE.gear_ratio - 0.5 * REFERENCE.driveline_inertia * spinning
    for side in plain().shaft_torque:
        assert side[PULL].mean() == pytest.approx(expected, rel=1e-3)


def test_front_wheels_slip_forward_under_drive_and_the_nose_rises() -> None:
    assert np.all(plain().slip[:2, PULL] > 0.005)
    assert np.all(np.abs(plain().slip[2:, PULL]) < 0.002)
    assert plain().pitch[PULL].mean() > np.radians(0.3)
    assert plain().pitch[(TIMES > 10.5) & (TIMES < 11.5)].mean() < np.radians(-0.3)


def test_left_and_right_change_places_with_their_shafts() -> None:
    swapped = REFERENCE.but(
        shaft_stiffness_left=REFERENCE.shaft_stiffness_right,
        shaft_stiffness_right=REFERENCE.shaft_stiffness_left,
        shaft_damping_left=REFERENCE.shaft_damping_right,
        shaft_damping_right=REFERENCE.shaft_damping_left,
    )
    for locked in (False, True):
        one, other = (Drive(car.but(differential_locked=locked), SHORT).travel(TIMES) for car in (REFERENCE, swapped))
        assert np.allclose(other.shaft_torque[0], one.shaft_torque[1], atol=0.1)
        apart = np.max(np.abs(one.shaft_torque[0] - one.shaft_torque[1]))
        assert apart > 20.0 if locked else apart < 0.1  # unequal shafts; an open differential has equal torques


def test_tightening_the_tolerance_changes_nothing_that_a_sensor_sees(monkeypatch: pytest.MonkeyPatch) -> None:
    usual = plain()
    monkeypatch.setattr("tests.plant.drive_motion.TOLERANCE", 1e-10)
    fine = travel({})
    assert np.max(np.abs(fine.speed - usual.speed)) < 1e-4
    assert np.max(np.abs(fine.shaft_torque - usual.shaft_torque)) < 0.05


def mean_change(effects: dict[str, float], where: Array, signal: str = "acceleration") -> float:
    return float(np.mean(getattr(travel(effects), signal)[where] - getattr(plain(), signal)[where]))


INERTIA = REFERENCE.mass + REFERENCE.rotating_mass
COASTING = {  # size, and (mean speed while coasting) -> change of the acceleration, by hand
    "extra_drag_area": (0.2, lambda v: -0.5 * AIR_DENSITY * 0.2 * v**2 / INERTIA),
    "headwind": (3.0, lambda v: -0.5 * AIR_DENSITY * REFERENCE.drag_area * (6 * v + 9) / INERTIA),
    "road_grade": (0.01, lambda v: -WEIGHT * 0.01 / INERTIA),
    "speed_dependent_rolling": (2e-4, lambda v: -2e-4 * v * WEIGHT / INERTIA),
    "tire_warmup": (0.2, lambda v: -0.2 * REFERENCE.rolling_resistance * WEIGHT * np.exp(-8.25 / 600) / INERTIA),
    "brake_drag": (40.0, lambda v: -40.0 / INERTIA),
    "brake_drag_fading": (40.0, lambda v: -40.0 * np.exp(-8.25 / 20) / INERTIA),
    "driveline_drag": (40.0, lambda v: -40.0 / INERTIA),
}


@pytest.mark.parametrize("effect", COASTING)
def test_an_effect_on_the_resistance_slows_the_coasting_car_as_by_hand(effect: str) -> None:
    size, expected = COASTING[effect]
    by_hand = expected(float(plain().speed[COAST].mean()))
    assert mean_change({effect: size}, COAST) == pytest.approx(by_hand, rel=0.08)


@pytest.mark.parametrize(
    ("effect", "size", "share"),
    [
        ("mass_error", 0.02, -0.0195),
        ("rotating_mass", 50.0, -50 / INERTIA),
        ("wheel_radius", 0.01, -0.0105),
        ("wheel_inertia", 0.5, -0.5 * 4 * REFERENCE.wheel_inertia / REFERENCE.wheel_radius**2 / INERTIA),
        ("motor_inertia", 1.0, -1.0 / REFERENCE.wheel_radius**2 / INERTIA),
    ],
)
def test_an_effect_on_inertia_or_radius_changes_the_pull(effect: str, size: float, share: float) -> None:
    assert mean_change({effect: size}, PULL) / plain().acceleration[PULL].mean() == pytest.approx(share, rel=0.15)


@pytest.mark.parametrize(
    ("effect", "size"),
    [("shaft_stiffness", -0.4), ("shaft_damping", -0.5), ("tire_relaxation", 1.0), ("backlash", 0.02)],
)
def test_an_effect_on_the_driveline_shakes_the_shafts_and_hardly_the_speed(effect: str, size: float) -> None:
    trip = travel({effect: size})
    assert np.max(np.abs(trip.shaft_torque - plain().shaft_torque)) > 1.0
    assert np.max(np.abs(trip.speed - plain().speed)) < 0.1


def test_a_profile_of_the_road_acts_where_it_is() -> None:
    at = 150.0
    hill = Drive(REFERENCE, SHORT, {"grade_profile": 0.02}).travel(TIMES, at)
    flat = Drive(REFERENCE, SHORT).travel(TIMES, at)
    inside = COAST & (hill.grade > 0.005)
    change = (hill.acceleration - flat.acceleration)[inside]
    assert np.allclose(change, -WEIGHT * np.sin(np.arctan(hill.grade[inside])) / INERTIA, atol=0.02)


def test_sensor_effects_change_readings_only() -> None:
    plain = drive.noise_free(REFERENCE, [SHORT], None, [TIMES])[0]
    effects = {"torque_gain": 0.01, "torque_offset": 2.0, "torque_delay": 0.05, "speed_scale": 0.01, "speed_delay": 0.1}
    read = drive.noise_free(REFERENCE, [SHORT], effects, [TIMES])[0]
    late = np.interp(TIMES - 0.05, SHORT.knots, SHORT.drive)
    assert np.allclose(read["Drive Torque [N m]"], 1.01 * late + 2.0)
    assert np.allclose(read["Speed [km/h]"], 1.01 * np.interp(TIMES - 0.1, TIMES, plain["Speed [km/h]"]))
    assert np.array_equal(read["Shaft Torque Left [N m]"], plain["Shaft Torque Left [N m]"])


def test_every_effect_is_nothing_at_zero_and_others_are_refused() -> None:
    zero = travel(dict.fromkeys(EFFECTS, 0.0))
    assert np.array_equal(zero.speed, plain().speed)
    assert np.array_equal(zero.shaft_torque, plain().shaft_torque)
    with pytest.raises(ValueError, match="no effect"):
        travel({"tailwind": 1.0})


def test_a_campaign_reaches_90_kmh_and_rests() -> None:
    runs = drive.campaign(REFERENCE, 5, count=2)
    assert [run.direction for run in runs] == ["out", "back"]
    for run in runs:
        speed = run.record["Speed [km/h]"]
        assert 85 < speed.max() < 98
        assert np.abs(speed[-200:]).max() < 0.5
        assert np.all(np.diff(run.record["Time [s]"]) > 0)
