"""The truth plant's wheel, pendulum, tire, shaft and silhouette: limits, balances, effects of the right sign."""

from __future__ import annotations

import io
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest
from PIL import Image
from scipy.optimize import least_squares

from tests.plant import bump, pendulum, shaft, silhouette, tire, wheel
from tests.plant.information import Information, from_constraints, from_means, prior, total
from tests.plant.vehicle import AIR_DENSITY, GRAVITY, REFERENCE, random_vehicle

pytestmark = pytest.mark.slow  # 12 s that check the plant, not the program


# --- wheel --------------------------------------------------------------------------------------------------------

DRIVE = wheel.drives(seed=1, count=1)[0]
TORQUE, TURN, FX, FZ, FORWARD, SPEED = wheel.SENSORS


def test_the_hub_torque_turns_the_wheel_and_the_rest_goes_to_the_road() -> None:
    log, v = wheel.noise_free(REFERENCE, DRIVE), REFERENCE
    road = log[FX] + v.wheel_mass * log[FORWARD]
    load = log[FZ] + v.wheel_mass * GRAVITY
    net = log[TORQUE] - road * v.wheel_radius - v.rolling_resistance * load * v.wheel_radius
    spun = np.concatenate([[0.0], np.cumsum((net[1:] + net[:-1]) / 2 * np.diff(DRIVE.times))])
    assert np.polyfit(log[TURN], spun, 1)[0] == pytest.approx(v.wheel_inertia, rel=2e-4)


def test_the_wheels_power_balance_closes_and_slip_only_loses() -> None:
    log, v = wheel.noise_free(REFERENCE, DRIVE), REFERENCE
    road = log[FX] + v.wheel_mass * log[FORWARD]
    sliding = v.wheel_radius * log[TURN] - log[SPEED]
    rolling = v.rolling_resistance * (log[FZ] + v.wheel_mass * GRAVITY) * v.wheel_radius * log[TURN]
    assert np.all(road * sliding >= -1e-9)
    kinetic = v.wheel_inertia * log[TURN] ** 2 / 2 + v.wheel_mass * log[SPEED] ** 2 / 2
    power = log[TORQUE] * log[TURN] - log[FX] * log[SPEED] - road * sliding - rolling
    work = np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2 * np.diff(DRIVE.times))])
    assert np.max(np.abs(work - (kinetic - kinetic[0]))) < 1e-3 * np.ptp(kinetic)


def test_the_car_gains_the_speed_that_its_accelerometer_feels() -> None:
    log = wheel.noise_free(REFERENCE, DRIVE)
    gained = np.concatenate([[0.0], np.cumsum((log[FORWARD][1:] + log[FORWARD][:-1]) / 2 * np.diff(DRIVE.times))])
    assert np.max(np.abs(log[SPEED] - log[SPEED][0] - gained)) < 1e-3
    rolling = np.abs(log[FX]) < 5.0
    drag = AIR_DENSITY / 2 * REFERENCE.drag_area * log[SPEED] ** 2 / REFERENCE.mass
    assert np.max(np.abs(log[FORWARD] + drag + REFERENCE.rolling_resistance * GRAVITY)[rolling]) < 0.02


def test_wheel_effects_act_on_their_channel_by_their_size() -> None:
    plain = wheel.noise_free(REFERENCE, DRIVE)

    def with_effect(name: str, size: float) -> dict[str, np.ndarray]:
        return wheel.noise_free(REFERENCE, DRIVE, {name: size})

    assert np.allclose(with_effect("brake_drag", 8.0)[TORQUE] - plain[TORQUE], 8.0)
    assert np.allclose(with_effect("bearing_drag", 0.1)[TORQUE] - plain[TORQUE], 0.1 * plain[TURN])
    assert np.allclose(with_effect("hub_torque_gain", 0.01)[TORQUE], 1.01 * plain[TORQUE])
    assert np.allclose(with_effect("hub_torque_offset", -5.0)[TORQUE] - plain[TORQUE], -5.0)
    assert np.allclose(with_effect("wheel_radius", 0.01)[TURN], plain[TURN] / 1.01)
    assert np.allclose(with_effect("wheel_mass", 2.0)[FX] - plain[FX], -2.0 * plain[FORWARD])
    late = with_effect("clock_offset", 0.01)
    assert np.array_equal(late[TURN], plain[TURN])
    assert np.allclose(late[TORQUE], np.interp(DRIVE.times - 0.01, DRIVE.times, plain[TORQUE]), atol=0.5)


# --- pendulum -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["compound", "bifilar", "torsional"])
def test_small_swings_have_the_textbook_period(kind: str) -> None:
    hung, inertia = pendulum.rig(REFERENCE, kind), REFERENCE.wheel_inertia
    factor = {
        "compound": (inertia + hung.mass * hung.distance**2) / (hung.mass * GRAVITY * max(hung.distance, 1e-9)),
        "bifilar": inertia * hung.cord / (hung.mass * GRAVITY * max(hung.distance, 1e-9) ** 2),
        "torsional": inertia / hung.stiffness,
    }[kind]
    assert pendulum.period(hung, inertia, 1e-3) == pytest.approx(2 * np.pi * factor**0.5, rel=1e-6)


def test_wide_swings_take_longer() -> None:
    hung = pendulum.rig(REFERENCE)
    ratio = pendulum.period(hung, 1.25, 0.3) / pendulum.period(hung, 1.25, 1e-3)
    assert ratio == pytest.approx(1 + 0.3**2 / 16 + 11 * 0.3**4 / 3072, rel=1e-6)


def test_friction_alone_takes_the_swings_energy() -> None:
    hung, swung = pendulum.rig(REFERENCE), pendulum.swing(seed=1)
    free = np.abs(pendulum.noise_free(replace(hung, friction=0.0), 1.25, swung))
    slowed = np.abs(pendulum.noise_free(hung, 1.25, swung))
    assert free[-1000:].max() == pytest.approx(free[:1000].max(), rel=1e-4)
    assert 0.3 < slowed[-1000:].max() / slowed[:1000].max() < 0.8


# --- tire ---------------------------------------------------------------------------------------------------------


def test_the_tires_curve_has_its_slope_its_peak_and_two_equal_sides() -> None:
    v = REFERENCE
    shape = (v.tire_B, v.tire_C, v.tire_D, v.tire_E)
    assert tire.friction(np.array(1e-6), *shape) / 1e-6 == pytest.approx(v.tire_longitudinal_stiffness, rel=1e-6)
    top = tire.peak_slip(v)
    near = tire.friction(np.array([0.98 * top, top, 1.02 * top, -top]), *shape)
    assert near[1] == pytest.approx(v.tire_D)
    assert max(near[0], near[2]) < near[1] == -near[3]


def test_tire_effects_act_in_their_direction() -> None:
    sweep = max(tire.sweeps(REFERENCE, seed=1), key=lambda s: float(s.load.mean()))
    turn, _, force, _ = tire.SENSORS
    plain = tire.noise_free(REFERENCE, sweep)

    def with_effect(name: str, size: float) -> dict[str, np.ndarray]:
        return tire.noise_free(REFERENCE, sweep, {name: size})

    over = sweep.load - REFERENCE.front_load / 2
    assert np.allclose(with_effect("load_sensitivity", 2e-5)[force], plain[force] * (1 - 2e-5 * over))
    read_slip = with_effect("slip_offset", 0.01)[turn] * REFERENCE.wheel_radius / sweep.speed - 1.0
    assert np.allclose(read_slip, sweep.slip + 0.01)
    assert np.allclose(with_effect("force_offset", 40.0)[force], plain[force] + 40.0)
    assert np.max(np.abs(with_effect("friction_fade", 0.01)[force])) < np.max(np.abs(plain[force]))
    late = with_effect("tire_relaxation", 0.3)[force]
    shifted = np.interp(sweep.times - 0.3 / sweep.speed.mean(), sweep.times, plain[force])
    assert np.max(np.abs(late - shifted)) < 0.1 * np.max(np.abs(late - plain[force]))


def test_noisy_slip_misleads_ordinary_least_squares() -> None:
    logs = tire.campaign(REFERENCE, seed=1)
    turn, speed, force, load = (np.concatenate([log[name] for log in logs]) for name in tire.SENSORS)
    slip = turn * REFERENCE.wheel_radius / (speed / 3.6) - 1.0
    fit = least_squares(lambda q: tire.friction(slip, *q) * load - force, [12.0, 1.6, 1.0, 0.3])
    assert fit.x[0] < 10.5


def test_sweeps_that_stop_short_of_the_peak_leave_the_peak_unknown() -> None:
    full, short = (tire.information(REFERENCE, seed=1, peak=peak) for peak in (True, False))
    assert full.bound()["tire_D"] < 1e-3
    assert short.bound()["tire_D"] > 0.1
    assert tire.stiffness_bound(REFERENCE, short) < 0.05 * REFERENCE.tire_longitudinal_stiffness


# --- shaft --------------------------------------------------------------------------------------------------------


def test_the_drawings_have_the_vehicles_stiffness() -> None:
    for vehicle in (REFERENCE, *map(random_vehicle, range(20))):
        for side in ("left", "right"):
            drawn = shaft.stiffness(shaft.drawing(vehicle, side), vehicle.shear_modulus)
            assert drawn == pytest.approx(getattr(vehicle, f"shaft_stiffness_{side}"), rel=1e-3)
    bar = shaft.Section(0.026, 0.0, 0.4)
    assert 1 / bar.compliance(79.3e9) == pytest.approx(79.3e9 * np.pi * 0.026**4 / 32 / 0.4)


def test_the_tip_in_winds_the_shaft_up_and_the_ends_speeds_tell_so() -> None:
    times = np.linspace(0.0, 4.0, 4001)
    torque, fast, slow, twist = shaft.noise_free(REFERENCE, times).values()
    k = shaft.truth(REFERENCE)["shaft_stiffness_left"]
    assert np.allclose(torque, k * twist + REFERENCE.shaft_damping_left * (fast - slow), atol=0.2)
    wound = np.concatenate([[0.0], np.cumsum(((fast - slow)[1:] + (fast - slow)[:-1]) / 2 * np.diff(times))])
    assert np.max(np.abs(twist - twist[0] - wound)) < 1e-5
    assert torque[1500] > 250.0 > 0.0 > torque[2500]


def test_shaft_effects_act_in_their_direction() -> None:
    times = np.linspace(0.0, 4.0, 4001)
    k, c = shaft.truth(REFERENCE)["shaft_stiffness_left"], REFERENCE.shaft_damping_left

    torque, fast, slow, twist = shaft.noise_free(REFERENCE, times, {"series_compliance": 1e-5}).values()
    assert np.allclose(torque, twist / (1 / k + 1e-5) + c * (fast - slow), atol=0.2)
    torque, fast, slow, twist = shaft.noise_free(REFERENCE, times, {"damping": 40.0}).values()
    assert np.allclose(torque, k * twist + (c + 40.0) * (fast - slow), atol=0.2)
    torque, fast, slow, twist = shaft.noise_free(REFERENCE, times, {"backlash": 0.01}).values()
    assert np.all(torque * twist >= -1e-9)
    assert np.all(torque[np.abs(twist) < 0.0099] == 0.0)
    assert np.mean(np.abs(twist) < 0.0099) > 0.002


# --- silhouette ---------------------------------------------------------------------------------------------------


def _measured(shot: silhouette.Photo) -> float:
    dark = np.asarray(Image.open(io.BytesIO(shot.png)), float) < 125
    dark &= np.asarray(Image.open(io.BytesIO(shot.mask_png))) == 0
    left, top, right, bottom = shot.box
    return float(np.sum(dark)) / ((right - left) * (bottom - top)) * shot.box_width * shot.box_height


@pytest.fixture(scope="module")
def shot() -> silhouette.Photo:
    return silhouette.photo(REFERENCE, seed=1)


def test_the_outline_and_the_picture_have_the_area(shot: silhouette.Photo) -> None:
    assert sum(map(silhouette.polygon_area, silhouette.outline(2.19))) == pytest.approx(2.19, rel=1e-9)
    assert shot.box_width * shot.box_height == pytest.approx(2.60, rel=1e-3)
    assert _measured(shot) == pytest.approx(2.19, rel=1e-3)
    assert len(silhouette.samples().files["silhouette.png"]) < 200_000


def test_a_car_behind_the_box_looks_smaller_and_mirrors_are_masked(shot: silhouette.Photo) -> None:
    behind = silhouette.photo(REFERENCE, seed=1, distance=10.0, depth=0.5)
    assert _measured(behind) * (10.5 / 10.0) ** 2 == pytest.approx(2.19, rel=2e-3)
    winged = silhouette.photo(REFERENCE, seed=1, effects={"mirrors": 1.0})
    assert _measured(winged) == pytest.approx(2.19, rel=1e-3)
    assert _measured(replace(winged, mask_png=shot.mask_png)) > 2.21


# --- all ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("part", [bump, wheel, pendulum, tire, shaft])
def test_logs_are_the_same_again_differ_between_seeds_and_know_their_effects(part: ModuleType) -> None:
    first, again, other = (part.campaign(REFERENCE, seed=seed)[0] for seed in (1, 1, 2))
    assert all(np.array_equal(first[name], again[name]) for name in first)
    assert not np.array_equal(list(first.values())[1], list(other.values())[1])
    assert np.all(np.diff(first["Time [s]"]) > 0.0)
    with pytest.raises(ValueError, match="has no effect"):
        part.campaign(REFERENCE, seed=1, effects={"gravity_waves": 1.0})


def _truths(part: ModuleType) -> dict[str, np.ndarray]:
    """What the first log of seed 1 would be without noise."""
    if part is bump:
        return bump.noise_free(REFERENCE, bump.runs(seed=1))[0]
    if part is wheel:
        return wheel.noise_free(REFERENCE, wheel.drives(seed=1)[0])
    if part is tire:
        return tire.noise_free(REFERENCE, tire.sweeps(REFERENCE, seed=1)[0])
    return shaft.noise_free(REFERENCE, shaft.campaign(REFERENCE, seed=1)[0]["Time [s]"])


@pytest.mark.parametrize("part", [bump, wheel, tire, shaft])
def test_logs_are_the_truth_and_the_noise_that_the_bounds_reckon_with(part: ModuleType) -> None:
    log = part.campaign(REFERENCE, seed=1)[0]
    for header, true in _truths(part).items():
        sensor = part.SENSORS[header]
        unit = 3.6 if "km/h" in header else float(np.degrees(1.0)) if "deg" in header else 1.0
        error = log[header] / unit - true
        assert np.std(error) == pytest.approx(np.hypot(sensor.noise, sensor.step / 12**0.5), rel=0.1)
        assert abs(np.mean(error)) < 4 * max(sensor.zero, 1e-4 * np.max(np.abs(true)), sensor.noise / 5)


def test_sample_logs_are_small() -> None:
    files = [f for part in (bump, wheel, pendulum, tire, shaft, silhouette) for f in part.samples().files.values()]
    assert sum(map(len, files)) < 6e6


# --- information --------------------------------------------------------------------------------------------------


def test_bounds_are_those_of_linear_regression() -> None:
    rng = np.random.default_rng(1)
    X, sd = rng.standard_normal((50, 3)), rng.uniform(0.5, 2.0, 50)
    exact = np.linalg.inv(X.T @ (X / sd[:, None] ** 2))
    info = from_means("abc", lambda batch: batch @ X.T, np.zeros(3), np.ones(3), sd)
    assert list(info.bound().values()) == pytest.approx(np.sqrt(np.diag(exact)))
    assert np.linalg.inv(info.reduced("ca").matrix) == pytest.approx(exact[np.ix_([2, 0], [2, 0])])
    assert info.known("b").matrix == pytest.approx(info.matrix[np.ix_([0, 2], [0, 2])])
    sure = total([info, prior({"b": 1e-9})]).known([]).reduced("ac")
    assert sure.matrix == pytest.approx(info.known("b").matrix)
    straight = from_constraints("abc", X, sd[None, :] ** 2)
    assert straight.matrix == pytest.approx(info.matrix)


def test_readings_of_a_line_that_are_noisy_both_ways() -> None:
    x, slope, sx, sy = np.linspace(0.0, 10.0, 40), 2.0, 0.3, 0.4
    band = np.full((1, x.size), sy**2 + (slope * sx) ** 2)
    info = from_constraints(["slope"], x[:, None], band)
    assert info == Information(("slope",), info.matrix)
    assert info.bound()["slope"] == pytest.approx(np.sqrt((sy**2 + slope**2 * sx**2) / np.sum(x**2)))
