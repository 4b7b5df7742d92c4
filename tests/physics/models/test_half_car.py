"""The half car against the truth plant, closed forms, and the parts that feed it: shapes, profiles, speed, search."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from tests.plant import bump as plant
from tests.plant.obstacle import Bump
from tests.plant.vehicle import GRAVITY, REFERENCE, Vehicle, random_vehicle
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.simulate import Drive, Simulated, Simulator
from vdyn_cli.physics.laws.road import half_sine, haversine, straight_lines
from vdyn_cli.physics.models.half_car import (
    BODY,
    LONGITUDINAL,
    ROLLING,
    SOUGHT,
    half_car,
    half_car_on_profile,
    sprung_body,
)
from vdyn_cli.steps.bump.crossing import at_limit
from vdyn_cli.steps.bump.half_car_modes import half_car_matrices, natural_modes
from vdyn_cli.steps.bump.known_car import usual_car
from vdyn_cli.steps.bump.measured_profile import simplified
from vdyn_cli.steps.bump.smooth_speed import smooth_speed

GIVEN = ("mass", "sprung_pitch_inertia", "cg_to_front", "wheelbase", "unsprung_mass_front", "unsprung_mass_rear")
CHANNELS = ("front_load", "rear_load", "speed", "vertical_acceleration", "pitch_rate")
COLUMNS = dict(zip(CHANNELS, plant.SENSORS, strict=True))


def values(vehicle: Vehicle, **changed: float) -> dict[str, float]:
    found = {n: float(getattr(vehicle, n)) for n in (*SOUGHT, *GIVEN)}
    found |= {
        "bump_height": 0.07,
        "bump_width": 0.48,
        "antenna_offset": 0.0,
        "outboard_mass": 0.0,
        **dict.fromkeys(LONGITUDINAL, 0.0),
    }
    return found | {"distance_front": 3.0, "speed_scale": 0.0, "speed_ramp": 0.0} | changed


def driven(model: Model, vehicle: Vehicle, crossing: plant.Crossing, **changed: float) -> Simulated:
    t = crossing.times
    inputs = {"speed": crossing.speed + crossing.speed_up * t, "elapsed": t}
    drive = Drive(t, inputs, {"position": crossing.speed * t[0]})
    return Simulator(model, values(vehicle, distance_front=crossing.distance, **changed), substeps=2)(drive)


BUMPS = {
    "haversine": Bump(),
    "half_sine": Bump(shape="half_sine"),
    "profile": Bump(shape="profile", table=np.array([[0.0, 0.1, 0.25, 0.4, 0.5], [0.0, 0.04, 0.06, 0.05, 0.0]])),
}


@pytest.mark.parametrize("shape", BUMPS)
@pytest.mark.parametrize("seed", [1, 4])
def test_it_rides_as_the_plant_does(shape: str, seed: int) -> None:
    vehicle, obstacle = random_vehicle(seed), BUMPS[shape]
    crossing = plant.runs(seed)[3]
    (true,) = plant.noise_free(vehicle, [crossing], bump=obstacle)
    if obstacle.table is None:
        found = driven(half_car(shape), vehicle, crossing)  # type: ignore[arg-type]
    else:
        model = half_car_on_profile(tuple(map(tuple, obstacle.table.T.tolist())))
        found = driven(model, vehicle, crossing, bump_height=1.0, bump_width=1.0)
    assert true[COLUMNS["front_load"]].min() == 0.0  # the wheel leaves the road
    corners = 1.0 if shape == "haversine" else 8.0  # a step over a corner of the road is less accurate
    for name, most in {"front_load": 5.0, "rear_load": 5.0, "vertical_acceleration": 3e-3, "pitch_rate": 5e-5}.items():
        assert np.max(np.abs(found.outputs[name] - true[COLUMNS[name]])) < most * corners, name


def test_at_rest_it_carries_its_weight_and_never_pulls() -> None:
    found = driven(half_car(), REFERENCE, plant.runs(1)[0])
    front, rear = found.outputs["front_load"], found.outputs["rear_load"]
    assert front[0] == pytest.approx(REFERENCE.front_load, rel=1e-12)
    assert front[0] + rear[0] == pytest.approx(REFERENCE.mass * GRAVITY, rel=1e-12)
    assert min(front.min(), rear.min()) == 0.0
    assert found.outputs["vertical_acceleration"][0] == 0.0


def still(vehicle: Vehicle, start: dict[str, float], seconds: float, **changed: float) -> Simulated:
    time = np.arange(0.0, seconds, 1e-3)
    drive = Drive(time, {"speed": 0.0, "elapsed": 0.0}, {"position": 0.0, **start})
    return Simulator(half_car(), values(vehicle, **changed))(drive, states=True)


def test_a_free_car_swings_as_its_matrices_say() -> None:
    vehicle = random_vehicle(3)
    start = {"heave": 2e-3, "pitch": 1e-3, "wheel_front": 1e-3, "wheel_rear": -1e-3, "heave_rate": 0.01}
    found = still(vehicle, start, 1.0)
    mass, damping, stiffness = half_car_matrices(values(vehicle))
    inverse = np.linalg.inv(mass)
    system = np.block([[np.zeros((4, 4)), np.eye(4)], [-inverse @ stiffness, -inverse @ damping]])
    names = ("heave", "pitch", "wheel_front", "wheel_rear", "heave_rate", "pitch_rate", "wheel_rate_front")
    first = np.array([start.get(n, 0.0) for n in names] + [0.0])
    # Rates of the wheels that are not given follow the body's.
    for k, end in ((6, "front"), (7, "rear")):
        first[k] = found.states[f"wheel_rate_{end}"][0]
    expected = expm(system * found.time[-1]) @ first
    for k, name in enumerate(names):
        assert found.states[name][-1] == pytest.approx(expected[k], abs=1e-8), name


def test_an_undamped_car_keeps_its_energy() -> None:
    free = {"suspension_damping_front": 0.0, "suspension_damping_rear": 0.0}
    found = still(REFERENCE, {"heave": 5e-3, "pitch": 4e-3}, 2.0, **free)
    mass, _, stiffness = half_car_matrices(values(REFERENCE))
    where = np.array([found.states[n] for n in ("heave", "pitch", "wheel_front", "wheel_rear")])
    rate = np.array([found.states[n] for n in ("heave_rate", "pitch_rate", "wheel_rate_front", "wheel_rate_rear")])
    energy = np.sum(where * (stiffness @ where), axis=0) + np.sum(rate * (mass @ rate), axis=0)
    assert np.ptp(energy) < 1e-5 * energy[0]


def test_modes_of_a_symmetric_car_have_a_closed_form() -> None:
    """Kf = Kr, lf = lr, no damping: bounce and each half of pitch are two masses on two springs."""
    k, kt, m, body = 40e3, 4e5, 80.0, 1400.0
    v = values(REFERENCE, cg_to_front=1.35, wheelbase=2.7, mass=body + 2 * m)
    for end in ("front", "rear"):
        v |= {f"unsprung_mass_{end}": m, f"suspension_stiffness_{end}": k, f"suspension_damping_{end}": 0.0}
    v |= {"tire_vertical_stiffness": kt, "sprung_pitch_inertia": 0.8 * body * 1.35**2}
    found = natural_modes(v)

    def pair(sprung: float) -> np.ndarray:
        squares = np.linalg.eigvals(np.array([[k / sprung, -k / sprung], [-k / m, (k + kt) / m]]))
        return np.sort(np.sqrt(squares.real)) / (2 * np.pi)

    assert found["bounce"][0] == pytest.approx(pair(body / 2)[0], rel=1e-9)
    assert found["pitch"][0] == pytest.approx(pair(0.8 * body / 2)[0], rel=1e-9)
    assert all(abs(ratio) < 1e-9 for _, ratio in found.values())


def test_a_hub_s_sensor_lacks_the_inertia_of_what_turns_outside_it() -> None:
    time = np.arange(0.0, 1.5, 5e-4)
    drive = Drive(time, {"speed": 4.0, "elapsed": 0.0}, {"position": 0.0})
    at = values(REFERENCE, distance_front=1.0)
    road, hub = (Simulator(half_car(), {**at, "outboard_mass": m})(drive, states=True) for m in (0.0, 40.0))
    acceleration = np.gradient(road.states["wheel_rate_front"], time)
    expected = road.outputs["front_load"] - 40.0 * (GRAVITY + acceleration)
    assert np.max(np.abs(hub.outputs["front_load"] - expected)) < 0.02 * np.ptp(expected)


def test_shapes_of_the_road() -> None:
    x = np.linspace(-0.2, 1.2, 57)
    inside = (x > 0) & (x < 1)
    cosine = np.where(inside, 0.5 * (1 - np.cos(2 * np.pi * x)), 0.0)
    assert np.allclose([float(haversine(v)) for v in x], cosine, atol=1e-15)
    assert np.allclose([float(half_sine(v)) for v in x], np.where(inside, np.sin(np.pi * x), 0.0), atol=1e-15)
    points = ((0.0, 0.0), (0.3, 0.05), (0.5, 0.02))
    kerb = straight_lines(points)
    assert np.allclose([float(kerb(v)) for v in x], np.interp(x, *zip(*points, strict=True)), atol=1e-15)


def test_a_dense_profile_is_thinned_within_its_tolerance() -> None:
    x = np.linspace(0.0, 0.6, 2000)
    height = 0.07 * np.sin(np.pi * x / 0.6) ** 2 + 0.01
    points, off = simplified(x, height)
    at, level = np.array(points).T
    assert len(points) <= 150
    assert off < 5e-5
    assert level[0] == 0.0
    assert np.max(np.abs(np.interp(x, at, level) - (height - height[0]))) == pytest.approx(off)


def test_the_sprung_body_s_center() -> None:
    sprung, to_front = sprung_body(1500.0, 1.2, 2.6, 90.0, 70.0)
    assert sprung == 1340.0
    assert sprung * to_front + 70.0 * 2.6 == pytest.approx(1500.0 * 1.2)


def test_a_usual_car_is_near_the_plant_s() -> None:
    start = usual_car(values(REFERENCE))
    assert all(0.5 < start[n] / getattr(REFERENCE, n) < 2.0 for n in SOUGHT)


def test_a_smooth_speed_bends_only_as_much_as_the_samples_ask_for() -> None:
    rng = np.random.default_rng(5)
    time = np.arange(0.0, 3.5, 0.002)
    true = 4.0 + 0.1 * (time - 1.75)
    speed = true + 0.02 * rng.standard_normal(time.size)
    speed[100:150] = np.nan
    found = smooth_speed(time, speed)
    assert np.max(np.abs(found.value - true)) < 4 * 4.0 * found.scale_std
    assert found.scale_std == pytest.approx(0.02 / np.sqrt(1700) / 4.0, rel=0.1)
    braked = true - 0.17 * (np.tanh((time - 1.0) / 0.06) + np.tanh((time - 1.65) / 0.06)) / 2
    bent = smooth_speed(time, braked + 0.02 * rng.standard_normal(time.size))
    assert np.max(np.abs(bent.value - braked)) < 0.03
    assert np.ptp(np.cumsum(bent.value - braked)[450:900]) * 0.002 < 3e-3  # m
    assert bent.scale_std > 1.5 * found.scale_std
    known = smooth_speed(time, braked + 0.02 * rng.standard_normal(time.size), 0.7 * (braked - true))
    assert np.max(np.abs(known.value - braked)) < 0.006
    assert known.scale_std < 1.4 * found.scale_std


def test_a_sensor_s_limit_is_seen_and_a_plateau_of_noise_is_not() -> None:
    rng = np.random.default_rng(2)
    trace = 1000.0 * np.sin(np.linspace(0.0, 9.0, 2000)) + 5.0 * rng.standard_normal(2000)
    assert not at_limit(trace, 5.0).any()
    cut = np.minimum(trace, 800.0)
    found = at_limit(cut, 5.0)
    assert np.all(found[cut == 800.0])
    assert np.all(cut[found] > 780.0)


def test_every_run_may_begin_in_motion() -> None:
    moving = still(REFERENCE, {"heave": 1e-2}, 0.5)
    share = REFERENCE.suspension_stiffness_front / (
        REFERENCE.suspension_stiffness_front + REFERENCE.tire_vertical_stiffness
    )
    assert moving.states["wheel_front"][0] == pytest.approx(1e-2 * share)
    assert set(BODY) <= set(moving.states)


def test_the_slope_of_the_road_brakes_the_car_and_pitches_it_and_keeps_its_energy() -> None:
    """Rigid hubs, no dampers: the work of the slope is all the energy that heave, pitch and axles have after it."""
    free = {"suspension_damping_front": 0.0, "suspension_damping_rear": 0.0}
    time = np.arange(0.0, 2.2, 5e-4)
    speed, lever = 4.5, 0.35
    drive = Drive(time, {"speed": speed, "elapsed": 0.0}, {"position": 0.0})
    at = values(REFERENCE, distance_front=1.0, bump_height=0.01, longitudinal_lever=lever, **free)
    found = Simulator(half_car(), at, substeps=2)(drive, states=True)
    past = found.states["position"] - 1.0 + lever * found.states["pitch"]
    height = lambda x: np.where((x > 0) & (x < 0.48), 0.005 * (1 - np.cos(2 * np.pi * x / 0.48)), 0.0)  # noqa: E731
    work = 0.0
    for end, x in (("front", past), ("rear", past - REFERENCE.wheelbase)):
        slope = (height(x + 1e-4) - height(x - 1e-4)) / 2e-4
        pace = speed + lever * found.states["pitch_rate"]
        work += float(np.trapezoid(found.outputs[f"{end}_load"] * slope * pace, time))
    mass, _, stiffness = half_car_matrices(at)
    where = np.array([found.states[n][-1] for n in ("heave", "pitch", "wheel_front", "wheel_rear")])
    rate = np.array([found.states[n][-1] for n in ("heave_rate", "pitch_rate", "wheel_rate_front", "wheel_rate_rear")])
    energy = (where @ stiffness @ where + rate @ mass @ rate) / 2
    assert energy == pytest.approx(work, rel=0.05)


def test_soft_hubs_move_back_on_the_rising_slope() -> None:
    """At a low pace e = -b Fz u' / m, the static deflection of the bushings."""
    time = np.arange(0.0, 4.0, 1e-3)
    compliance, pace = 1.2e-4, 0.3
    drive = Drive(time, {"speed": pace, "elapsed": 0.0}, {"position": 0.7})
    at = values(REFERENCE, distance_front=1.0, bump_height=0.02, hub_compliance_front=compliance)
    found = Simulator(half_car(), at, substeps=2)(drive, states=True)
    x = found.states["position"] - 1.0
    slope = np.where((x > 0) & (x < 0.48), 0.01 * 2 * np.pi / 0.48 * np.sin(2 * np.pi * x / 0.48), 0.0)
    expected = -compliance * found.outputs["front_load"] * slope / (ROLLING * REFERENCE.unsprung_mass_front)
    assert np.max(np.abs(found.states["hub_front"] - expected)) < 0.12 * np.max(np.abs(expected))
