"""The truth plant's coast-downs: closed form, energy, hidden effects by hand, noise as stated, bounds that behave."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.plant import coast
from tests.plant.coast import DAY, POWERED, QUIET, WIDE
from tests.plant.coast_information import Case, information, whiten
from tests.plant.coast_motion import EFFECTS, Car, Plan, calm, road_profile
from tests.plant.vehicle import GRAVITY, REFERENCE, random_vehicle
from tests.plant.wind import Wind, gusts

pytestmark = pytest.mark.slow  # checks the plant, not the program

WEIGHT = REFERENCE.mass * GRAVITY
INERTIA = REFERENCE.mass + REFERENCE.rotating_mass


def one(speed: float = 20.0, heading: float = 1.0, position: float = 240.0, temperature: float = 20.0) -> Plan:
    """A plan of a single run that starts just so, sampled for a minute."""
    samples = (np.arange(0.0, 60.0, 0.1),)
    values = (np.array([x]) for x in (heading, 100.0, speed, position, temperature))
    return Plan(*values, samples, np.zeros((0, 1)))


def deceleration(effects: dict[str, float], speed: float = 20.0, time: float = 7.0, **where: float) -> float:
    car = Car(REFERENCE, 1.225, one(speed, **where), effects)
    here = np.array([where.get("position", 240.0)])
    wind = np.array([effects.get("headwind", 0.0) * where.get("heading", 1.0)])
    return float(-car.acceleration(time, np.array([speed]), here, wind, np.zeros(1))[0])


def test_without_wind_and_grade_the_speed_follows_the_closed_form() -> None:
    a = REFERENCE.rolling_resistance * WEIGHT / INERTIA
    b = 0.5 * 1.225 * REFERENCE.drag_area / INERTIA
    plan = coast.plan(REFERENCE, 1, QUIET)
    for times, start, speed in zip(plan.samples, plan.speed, coast.noise_free(REFERENCE, plan, QUIET), strict=True):
        closed = np.sqrt(a / b) * np.tan(np.arctan(start * np.sqrt(b / a)) - np.sqrt(a * b) * times)
        assert np.max(np.abs(speed - closed)) < 1e-5


def test_the_papers_numbers_take_71_6_s_from_70_to_25_kmh() -> None:
    car = REFERENCE.but(rolling_resistance=0.014, wheel_inertia=0.0, driveline_inertia=0.0)
    day = QUIET.but(start_speed=70 / 3.6, end_speed=25 / 3.6, runs=1)
    plan = replace(one(speed=70 / 3.6), samples=(np.arange(0.0, 80.0, 0.1),))
    speed = coast.noise_free(car, plan, day)[0]
    assert np.interp(-25 / 3.6, -speed, plan.samples[0]) == pytest.approx(71.6, abs=0.1)


def test_energy_is_conserved_on_a_hilly_road_with_drive_torque() -> None:
    day = POWERED.but(runs=2)
    plan = coast.plan(REFERENCE, 3, day)
    car = Car(REFERENCE, day.air_density, plan, {"grade_profile": 0.02})
    path = car.move(calm(2, plan.steps), plan.steps)
    v, middle = path.speed, 0.5 * (path.speed[1:] + path.speed[:-1])
    times = path.clock[:-1] + 0.5 * np.diff(path.clock)
    slope = np.arctan(np.interp(times, path.clock, path.grade[:, 0]))
    friction = (
        REFERENCE.rolling_resistance * WEIGHT * np.cos(slope) + 0.5 * 1.225 * REFERENCE.drag_area * middle[:, 0] ** 2
    )
    force = car.torque(times)[:, 0] * REFERENCE.gear_ratio / REFERENCE.wheel_radius
    work = float(np.sum((force - friction - WEIGHT * np.sin(slope)) * middle[:, 0]) * 0.1)
    kinetic = 0.5 * INERTIA * (v[-1, 0] ** 2 - v[0, 0] ** 2)
    moved = float(np.sum(force * middle[:, 0]) * 0.1)
    assert abs(work - kinetic) < 1e-3 * moved


AIR = 0.5 * 1.225 * 20.0
BY_HAND = {
    "extra_drag_area": (0.1, AIR * 20.0 * 0.1 / INERTIA),
    "headwind": (2.0, AIR / 20.0 * REFERENCE.drag_area * (22.0**2 - 20.0**2) / INERTIA),
    "road_grade": (0.01, WEIGHT * 0.01 / INERTIA),
    "grade_profile": (0.01, WEIGHT * 0.01 * float(road_profile(np.float64(240.0))) / INERTIA),
    "speed_dependent_rolling": (1e-4, 1e-4 * 20.0 * WEIGHT / INERTIA),
    "tire_warmup": (0.2, 0.2 * np.exp(-107.0 / 600.0) * REFERENCE.rolling_resistance * WEIGHT / INERTIA),
    "brake_drag": (30.0, 30.0 / INERTIA),
    "brake_drag_fading": (30.0, 30.0 * np.exp(-7.0 / 20.0) / INERTIA),
    "driveline_drag": (50.0, 50.0 / INERTIA),
    "driveline_drag_viscous": (3.0, 60.0 / INERTIA),
    "drag_bump": (40.0, 40.0 * np.exp(-0.5 * (5.0 / 1.5) ** 2) / INERTIA),
}


@pytest.mark.parametrize("effect", BY_HAND)
def test_an_effect_pulls_as_hard_as_by_hand(effect: str) -> None:
    size, expected = BY_HAND[effect]
    assert deceleration({effect: size}) - deceleration({}) == pytest.approx(expected, rel=2e-3, abs=1e-7)


@pytest.mark.parametrize("effect", ["headwind", "road_grade", "grade_profile"])
def test_effects_of_the_place_turn_round_with_the_car(effect: str) -> None:
    out = deceleration({effect: 0.01}) - deceleration({})
    back = deceleration({effect: 0.01}, heading=-1.0) - deceleration({}, heading=-1.0)
    assert back == pytest.approx(-out, rel=2e-3)


def test_mass_temperature_and_inertia_act_as_stated() -> None:
    air = AIR * 20.0 * REFERENCE.drag_area
    friction = REFERENCE.rolling_resistance * WEIGHT
    heavy = (air + 1.02 * friction) / (1.02 * REFERENCE.mass + REFERENCE.rotating_mass)
    assert deceleration({"mass_error": 0.02}) == pytest.approx(heavy, rel=1e-9)
    assert deceleration({"rotating_mass": 50.0}) == pytest.approx((air + friction) / (INERTIA + 50.0), rel=1e-9)
    warm = (air + friction / (1 + 8.6e-3 * 10)) / INERTIA
    assert deceleration({"temperature_rolling": 8.6e-3}, temperature=30.0) == pytest.approx(warm, rel=1e-9)


def test_sensor_effects_change_the_reading_and_not_the_motion() -> None:
    day = QUIET.but(runs=1, powered=30.0)
    plain = coast.campaign(REFERENCE, 5, day)[0].record
    effects = {"speed_scale": 0.01, "speed_delay": 0.5, "torque_gain": -0.02, "torque_offset": 3.0}
    changed = coast.campaign(REFERENCE, 5, day, effects)[0].record
    late = np.interp(plain["Time [s]"] - 0.5, plain["Time [s]"], plain["GPS Speed [km/h]"])
    assert np.allclose(changed["GPS Speed [km/h]"][10:], 1.01 * late[10:], atol=1e-6)
    assert np.allclose(changed["Drive Torque [N m]"], 0.98 * plain["Drive Torque [N m]"] + 3.0)


def test_a_larger_wheel_makes_less_force_of_the_torque() -> None:
    plan = coast.plan(REFERENCE, 5, POWERED)
    push = Car(REFERENCE, 1.225, plan, {"wheel_radius": 0.01}).force_per_torque
    assert push == pytest.approx(REFERENCE.gear_ratio / REFERENCE.wheel_radius / 1.01)


def test_the_accelerometer_measures_specific_force() -> None:
    day = QUIET.but(runs=2, acceleration=coast.sensors.Sensor())
    flat = coast.campaign(REFERENCE, 4, day)
    hill = coast.campaign(REFERENCE, 4, day, {"road_grade": 0.01})
    for level, slope in zip(flat, hill, strict=True):
        sign = 1.0 if slope.direction == "out" else -1.0
        time, speed = slope.record["Time [s]"], slope.record["GPS Speed [km/h]"] / 3.6
        rate = np.gradient(speed, time)[5:-5]
        felt = slope.record["Long Accel [m/s^2]"][5:-5]
        assert np.allclose(felt - rate, sign * GRAVITY * np.sin(np.arctan(0.01)), atol=2e-4)
        # Slope drops out but for the rotating mass: the same resistance is felt on the hill and on the flat.
        assert level.record["Long Accel [m/s^2]"][0] == pytest.approx(slope.record["Long Accel [m/s^2]"][0], abs=6e-3)
    offset = coast.campaign(REFERENCE, 4, day, {"accelerometer_offset": 0.05, "accelerometer_tilt": 0.01})
    shift = offset[0].record["Long Accel [m/s^2]"] - flat[0].record["Long Accel [m/s^2]"]
    assert np.allclose(shift, 0.05 + GRAVITY * np.sin(0.01), atol=1e-4)


@pytest.mark.parametrize("effect", EFFECTS)
def test_an_effect_of_no_size_is_nothing(effect: str) -> None:
    plan = coast.plan(REFERENCE, 2, QUIET.but(runs=2))
    day = QUIET.but(runs=2)
    none = coast.noise_free(REFERENCE, plan, day)
    if not effect.endswith("_time"):
        some = coast.noise_free(REFERENCE, plan, day, {effect: 0.0})
        assert all(np.array_equal(a, b) for a, b in zip(none, some, strict=True))


def test_an_unknown_effect_is_refused() -> None:
    with pytest.raises(ValueError, match="no effect"):
        coast.campaign(REFERENCE, 1, DAY, {"tailwind": 1.0})


def test_gusts_have_the_stated_strength_and_time() -> None:
    w = gusts(Wind(0.6, 8.0), 200, 3000, 0.1, np.random.default_rng(0))
    assert w.std() == pytest.approx(0.6, rel=0.02)
    assert np.mean(w[80:] * w[:-80]) / np.mean(w * w) == pytest.approx(np.exp(-1.0), abs=0.02)
    assert w[0].std() == pytest.approx(w[-1].std(), rel=0.2)


@pytest.mark.parametrize("day", [DAY, POWERED], ids=["coasting", "powered"])
def test_whitened_noise_is_white_and_of_unit_size(day: coast.Day) -> None:
    day = day.but(wind=Wind(between_runs=0.0), rolling_scatter=0.0, torque=day.torque.but(noise=0.0, step=0.0))
    plan = coast.plan(REFERENCE, 1, day)
    calm_speed = coast.noise_free(REFERENCE, plan, day)
    rng = np.random.default_rng(7)
    noise: list[list[np.ndarray]] = [[] for _ in range(day.runs)]
    for seed in range(12):
        windy = coast.noise_free(REFERENCE, plan, day, None, coast.scatter(day, plan.steps, seed))
        for k in range(day.runs):
            noise[k].append(windy[k] - calm_speed[k] + day.speed.noise * rng.standard_normal(windy[k].size))
    case = Case(REFERENCE, plan, day, {}, calm(day.runs, plan.steps))
    white = np.concatenate([w.ravel() for w in whiten(case, [np.array(n).T for n in noise])])
    assert white.std() == pytest.approx(1.0, abs=0.01)
    columns = whiten(case, [np.array(n).T for n in noise])
    for lag in (1, 3, 10, 50):
        assert abs(np.mean([np.mean(c[lag:] * c[:-lag]) for c in columns])) < 0.01


@pytest.mark.slow
def test_the_bound_behaves() -> None:
    eight = information(REFERENCE, 1)
    sixteen = information(REFERENCE, 1, DAY.but(runs=16))
    wide = information(REFERENCE, 1, WIDE)
    for name in ("rolling_resistance", "drag_area"):
        assert sixteen.bound()[name] == pytest.approx(eight.bound()[name] / 2**0.5, rel=0.1)
        assert wide.bound()[name] < eight.bound()[name]
    # About 1 % of the rolling resistance comes from its scatter and the winds of eight runs.
    assert 0.003 < eight.bound()["rolling_resistance"] / REFERENCE.rolling_resistance < 0.02
    one_way = information(REFERENCE, 1, DAY.but(one_way=True), unknowns=("road_grade",)).bound()["road_grade"]
    both = information(REFERENCE, 1, unknowns=("road_grade",)).bound()["road_grade"]
    assert both < 0.1 * one_way


def test_a_campaign_is_repeatable_and_every_car_comes_to_the_end_speed() -> None:
    first, again = coast.campaign(REFERENCE, 9), coast.campaign(REFERENCE, 9)
    assert all(np.array_equal(a.record[h], b.record[h]) for a, b in zip(first, again, strict=True) for h in a.record)
    for seed in range(8):
        for run in coast.campaign(random_vehicle(seed), seed):
            speed, time = run.record["GPS Speed [km/h]"], run.record["Time [s]"]
            assert np.all(np.diff(time) > 0)
            assert 70 < speed[0] < 80
            assert 10 < speed[-1] < 30
            way = np.sign(run.record["Position [m]"][-1] - run.record["Position [m]"][0])
            assert way == (1.0 if run.direction == "out" else -1.0)
