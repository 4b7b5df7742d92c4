"""The truth plant's car over a bump: limits, balances, effects of the right sign."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.plant import bump, half_car
from tests.plant.obstacle import Bump
from tests.plant.vehicle import GRAVITY, REFERENCE

pytestmark = pytest.mark.slow  # check the plant, not the program

FRONT, REAR, ACCEL, PITCH = "Front Load [N]", "Rear Load [N]", "Vertical Accel [m/s^2]", "Pitch Rate [deg/s]"
CROSSINGS = bump.runs(seed=1, count=1, duration=2.8)


def test_a_flat_road_leaves_the_car_at_rest_under_its_own_weight() -> None:
    log = bump.noise_free(REFERENCE, CROSSINGS, bump=Bump(height=0.0))[0]
    assert np.ptp(log[FRONT]) == 0.0
    assert np.all(log[ACCEL] == 0.0)
    assert log[FRONT][0] + log[REAR][0] == pytest.approx(REFERENCE.mass * GRAVITY, rel=1e-12)


def test_over_a_hill_the_car_follows_the_road(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bump, "STEP", 2e-3)
    hill = Bump(height=0.5, width=40.0)
    crossing = replace(bump.runs(seed=1, count=1, duration=28.0)[0], speed=1.7, speed_up=0.0)
    log = bump.noise_free(REFERENCE, [crossing], bump=hill)[0]
    t, v = crossing.times, crossing.speed + crossing.speed_up * crossing.times
    front = crossing.speed * t + crossing.speed_up / 2 * t**2 - crossing.distance
    rising = (hill.slope(front) - hill.slope(front - REFERENCE.wheelbase)) * v / REFERENCE.wheelbase
    assert np.max(np.abs(log[PITCH] - rising)) < 0.1 * np.max(np.abs(rising))
    assert np.max(np.abs(log[FRONT] / REFERENCE.front_load - 1.0)) < 0.02


def test_a_car_without_springs_moves_as_a_rigid_body_on_two_points() -> None:
    hard = REFERENCE.but(
        suspension_stiffness_front=4e9,
        suspension_stiffness_rear=4e9,
        suspension_damping_front=1e7,
        suspension_damping_rear=1e7,
        tire_vertical_stiffness=4e9,
        tire_damping=1e7,
    )
    low = Bump(height=0.01, width=4.0)
    crossing = replace(CROSSINGS[0], speed_up=0.0)
    log = bump.noise_free(hard, [crossing], bump=low)[0]
    front = crossing.speed * crossing.times - crossing.distance
    slope = (low.slope(front) - low.slope(front - hard.wheelbase)) * crossing.speed / hard.wheelbase
    assert np.max(np.abs(log[PITCH] - slope)) < 0.01 * np.max(np.abs(slope))


def test_an_undamped_car_keeps_its_energy_after_the_bump() -> None:
    bare = REFERENCE.but(suspension_damping_front=0.0, suspension_damping_rear=0.0)
    (cars,) = (bump._cars([bare], {}),)
    step, times = 5e-4, 5e-4 / 2 * np.arange(2 * 6000 + 1)
    road, slope = np.zeros((1, times.size, 2)), np.zeros((1, times.size, 2))
    road[0, :, 0] = np.where(times < 0.2, 0.01 * np.sin(np.pi * times / 0.2) ** 2, 0.0)
    state = half_car.ride(cars, road, slope, step).state[0, 500:]
    length = (cars.lengths() @ state[:, :4].T)[0].T
    stored = length**2 @ cars.stiffness[0] + state[:, 2:4] ** 2 @ cars.tire_stiffness[0]
    moving = state[:, 4:] ** 2 @ np.array([cars.sprung_mass[0], cars.pitch_inertia[0], *cars.unsprung_mass[0]])
    assert np.ptp(stored + moving) < 1e-9 * np.max(stored + moving)


def test_another_integrator_gives_the_same_loads_with_the_wheels_in_the_air() -> None:
    v, crossing, rise = REFERENCE, replace(CROSSINGS[0], speed_up=0.0), Bump()
    log = bump.noise_free(v, [crossing])[0]

    def loads(t: float, y: np.ndarray) -> tuple[float, float]:
        front = crossing.speed * t - crossing.distance
        u = rise.level(np.array([front, front - v.wheelbase]))
        return (
            max(0.0, v.front_load + v.tire_vertical_stiffness * (u[0] - y[4])),
            max(0.0, v.rear_load + v.tire_vertical_stiffness * (u[1] - y[6])),
        )

    def rates(t: float, y: np.ndarray) -> list[float]:
        z, dz, th, dth, zf, dzf, zr, dzr = y
        sf = v.suspension_stiffness_front * (z + v.cg_to_front * th - zf)
        sf += v.suspension_damping_front * (dz + v.cg_to_front * dth - dzf)
        sr = v.suspension_stiffness_rear * (z - v.cg_to_rear * th - zr)
        sr += v.suspension_damping_rear * (dz - v.cg_to_rear * dth - dzr)
        ff, fr = loads(t, y)
        turn = (v.cg_to_rear * sr - v.cg_to_front * sf) / v.sprung_pitch_inertia
        wheels = (sf + ff - v.front_load) / v.unsprung_mass_front, (sr + fr - v.rear_load) / v.unsprung_mass_rear
        return [dz, -(sf + sr) / v.sprung_mass, dth, turn, dzf, wheels[0], dzr, wheels[1]]

    solution = solve_ivp(
        rates, (0.0, crossing.times[-1]), np.zeros(8), t_eval=crossing.times, rtol=1e-8, atol=1e-10, max_step=2e-3
    )
    expected = np.array([loads(t, y) for t, y in zip(solution.t, solution.y.T, strict=True)])
    assert expected.min() == 0.0
    assert np.max(np.abs(log[FRONT] - expected[:, 0])) < 2.0
    assert np.max(np.abs(log[REAR] - expected[:, 1])) < 2.0
    assert np.max(np.abs(log[PITCH] - solution.y[3])) < 1e-4


@pytest.mark.parametrize("effect", bump.EFFECTS)
def test_a_bump_effect_of_size_zero_is_nothing(effect: str) -> None:
    plain, same = (bump.noise_free(REFERENCE, CROSSINGS, effects) for effects in ({}, {effect: 0.0}))
    assert all(np.array_equal(a[name], b[name]) for a, b in zip(plain, same, strict=True) for name in a)


def test_bump_effects_act_in_their_direction() -> None:
    plain = bump.noise_free(REFERENCE, CROSSINGS)[0]

    def with_effect(name: str, size: float) -> dict[str, np.ndarray]:
        return bump.noise_free(REFERENCE, CROSSINGS, {name: size})[0]

    assert with_effect("asymmetric_damping", 0.5)[ACCEL].max() < plain[ACCEL].max()  # softer in compression
    still = CROSSINGS[0].times > 2.2
    assert np.ptp(with_effect("suspension_friction", 150.0)[PITCH][still]) < 0.7 * np.ptp(plain[PITCH][still])
    assert with_effect("progressive_spring", 3.0)[ACCEL].max() > plain[ACCEL].max()
    first_rise = np.argmax(plain[FRONT] > plain[FRONT][0] + 2000.0)
    assert with_effect("tire_damping", 300.0)[FRONT][first_rise] > plain[FRONT][first_rise]
    wide = with_effect("tire_enveloping", 0.15)[FRONT]
    assert wide.max() < plain[FRONT].max()
    assert np.argmax(wide > wide[0] + 1.0) < np.argmax(plain[FRONT] > plain[FRONT][0] + 1.0)
    assert np.allclose(with_effect("speed_error", 0.02)["Speed [km/h]"], 1.02 * plain["Speed [km/h]"])
    late = with_effect("clock_offset", 0.02)[PITCH]
    shifted = np.interp(CROSSINGS[0].times - 0.02, CROSSINGS[0].times, plain[PITCH])
    assert np.allclose(late[100:], shifted[100:], atol=2e-3)


@pytest.mark.parametrize("shape", ["haversine", "half_sine", "profile"])
def test_a_bumps_slope_is_its_rise_and_a_patch_its_mean(shape: str) -> None:
    table = np.array([[0.0, 0.1, 0.35, 0.48], [0.0, 0.05, 0.07, 0.0]])
    plain, felt = (Bump(shape=shape, table=table, patch=patch) for patch in (0.0, 0.1))
    s = np.linspace(-0.2, 0.7, 9001)
    for profile in (plain, felt):
        rise = np.concatenate([[0.0], np.cumsum((profile.slope(s)[1:] + profile.slope(s)[:-1]) / 2 * np.diff(s))])
        assert np.max(np.abs(rise - profile.level(s))) < 1e-4
    mean = np.mean([plain.level(s + shift) for shift in np.linspace(-0.05, 0.05, 2001)], axis=0)
    assert np.max(np.abs(mean - felt.level(s))) < 3e-5
