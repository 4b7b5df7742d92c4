"""Unlogged friction braking in drives of a car with recuperation."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant.sensors import Array
from vdyn_cli.steps.validate.drives.unlogged_braking import UnloggedBraking, unlogged_braking

MASS, RADIUS, STEP = 1700.0, 0.32, 0.1  # kg, m, s
MOST = -500.0  # N m at the wheels: what recuperation can do


Driven = tuple[Array, dict[str, Array], Array, Array]


def drive(seed: int, blended: bool, lost: float = 0.0, wind: float = 0.0) -> Driven:
    """A drive of ten accelerations and stops: time, channels, torque at the wheels, and the brake's true torque."""
    rng = np.random.default_rng(seed)
    top, rate = rng.uniform(10.0, 25.0, 10), rng.uniform(1.0, 1.8, 10)
    legs = [(0.0, 3.0)]
    for v, a in zip(top, rate, strict=True):
        legs += [(v, v / 1.2), (v, 10.0), (0.0, v / a), (0.0, 3.0)]
    at = np.cumsum([t for _, t in legs])
    time = np.arange(0.0, at[-1], STEP)
    speed = np.interp(time, at, [v for v, _ in legs])
    speed = np.convolve(np.pad(speed, 5, mode="edge"), np.ones(11) / 11, "valid")
    load = 130.0 + 0.5 * 1.2 * 0.6 * (speed + wind) ** 2
    wanted = (MASS * np.gradient(speed, time) + load * (speed > 0.1)) * RADIUS
    wanted = wanted * np.where(wanted > 0, 1 + lost, 1 - lost)
    torque = np.maximum(wanted, MOST)
    brake = torque - wanted if blended else np.zeros(time.size)
    if not blended:
        torque = wanted
    noisy = speed + 0.02 * rng.standard_normal(time.size)
    return time, {"speed": noisy, "brake_torque": np.zeros(time.size)}, torque + rng.standard_normal(time.size), brake


def found(*drives: Driven) -> tuple[UnloggedBraking, ...]:
    return unlogged_braking([one[:3] for one in drives])


def test_blended_braking_without_a_channel_is_found_and_named() -> None:
    drives = [drive(seed, blended=True) for seed in range(3)]
    for one, (time, channels, _, brake) in zip(found(*drives), drives, strict=True):
        strong = (brake > 0.2 * MASS * RADIUS) & (channels["speed"] > 2.5)
        assert strong.mean() > 0.05
        assert one.braked[strong].mean() > 0.97
        assert one.braked[(brake == 0.0) & (channels["speed"] > 5.0)].mean() < 0.1
        assert one.excess == pytest.approx(brake.max() / MASS / RADIUS, rel=0.15)
        (finding,) = one.finding("drive.csv")
        assert "brakes or hills that are not logged, left out" in finding.what
        assert time[0] <= one.spans[0][0] < one.spans[-1][1] <= time[-1]


@pytest.mark.parametrize(("lost", "wind"), [(0.0, 0.0), (0.1, 0.0), (0.0, 5.0)])
def test_recuperation_losses_and_wind_are_no_brakes(lost: float, wind: float) -> None:
    assert not any(one.spans for one in found(*(drive(seed, False, lost, wind) for seed in range(3))))


def test_recuperation_that_the_torque_lacks_is_stated() -> None:
    drives = [drive(seed, blended=False) for seed in range(3)]
    complete = [(time, channels, torque) for time, channels, torque, _ in drives]
    clipped = [(time, channels, np.maximum(torque, 0.0)) for time, channels, torque in complete]
    for one, (_, channels, torque) in zip(unlogged_braking(clipped), complete, strict=True):
        (finding,) = one.finding("drive.csv")
        assert "recuperation or engine braking, since drive_torque is never below zero" in finding.what
        lacking = STEP * np.count_nonzero((torque < -50.0) & (channels["speed"] > 2.0))
        assert one.left_out == pytest.approx(lacking, rel=0.3)
        assert not finding.doubt
    blended = [drive(seed, blended=True) for seed in range(3)]
    assert not any(one.one_sided for one in found(*blended))


def test_recuperation_that_the_torque_lacks_is_doubted_where_the_brakes_are_logged() -> None:
    """Friction brakes are then no cause of it."""
    clipped = []
    for time, channels, torque, _ in (drive(seed, blended=False) for seed in range(3)):
        held = np.where(channels["speed"] < 0.5, 300.0, 0.0)
        clipped.append((time, {**channels, "brake_torque": held}, np.maximum(torque, 0.0)))
    for one in unlogged_braking(clipped):
        (finding,) = one.finding("drive.csv")
        assert finding.doubt
        assert finding.where == "drive.csv, channel 'drive_torque'"
        assert "lacks recuperation or engine braking" in finding.what


def test_brakes_that_a_channel_shows_are_not_named_again() -> None:
    time, channels, torque, brake = drive(1, blended=True)
    logged = {**channels, "brake_torque": brake}
    assert not unlogged_braking([(time, logged, torque)])[0].spans


def rolling_over_hills(grade: float, brake: float) -> Driven:
    """Driven at constant power, then rolling free over a hill for 25 s, or braked there by an unlogged brake."""
    rng = np.random.default_rng(6)
    time = np.arange(0.0, 150.0, STEP)
    phase = time % 50.0
    torque = np.where(phase < 25.0, 400.0 * np.clip(phase, 0.0, 1.0), 0.0)
    hill = np.where(phase >= 27.0, grade * np.sin(np.pi * (phase - 27.0) / 23.0), 0.0)
    stopped = np.where((phase > 30.0) & (phase < 38.0), brake, 0.0)
    speed, felt = np.empty(time.size), np.empty(time.size)
    now = 15.0
    for k in range(time.size):
        felt[k] = (torque[k] / RADIUS - 130.0 - 0.36 * now**2) / MASS - stopped[k]
        now += STEP * (felt[k] - 9.81 * hill[k])
        speed[k] = now
    channels = {
        "speed": speed + 0.02 * rng.standard_normal(time.size),
        "acceleration": felt + 0.15 + 0.05 * rng.standard_normal(time.size),
        "brake_torque": np.zeros(time.size),
    }
    return time, channels, torque, stopped


def test_an_accelerometer_tells_a_hill_from_a_brake() -> None:
    time, channels, torque, _ = rolling_over_hills(0.03, 0.0)
    blind = {n: v for n, v in channels.items() if n != "acceleration"}
    (guess,) = unlogged_braking([(time, blind, torque)])
    (finding,) = guess.finding("drive.csv")
    assert "brakes or hills that are not logged" in finding.what
    assert "and grade" in finding.remedy
    assert not unlogged_braking([(time, channels, torque)])[0].spans


def test_a_logged_hill_is_no_brake() -> None:
    time, channels, torque, _ = rolling_over_hills(0.03, 0.0)
    phase = time % 50.0
    logged = np.where(phase >= 27.0, 0.03 * np.sin(np.pi * (phase - 27.0) / 23.0), 0.0)
    seen = {"speed": channels["speed"], "brake_torque": channels["brake_torque"], "grade": logged}
    assert not unlogged_braking([(time, seen, torque)])[0].spans


def test_an_accelerometer_feels_a_brake() -> None:
    time, channels, torque, brake = rolling_over_hills(0.0, 0.5)
    (one,) = unlogged_braking([(time, channels, torque)])
    assert one.braked[brake > 0].mean() > 0.9
    assert "brakes that are not logged" in one.finding("drive.csv")[0].what


def test_a_brake_on_a_road_of_known_grade_is_no_hill() -> None:
    time, channels, torque, _ = rolling_over_hills(0.0, 0.5)
    seen = {n: v for n, v in channels.items() if n != "acceleration"} | {"grade": np.full(time.size, 1e-4)}
    (one,) = unlogged_braking([(time, seen, torque)])
    (finding,) = one.finding("drive.csv")
    assert "brakes that are not logged" in finding.what
    assert "grade" not in finding.remedy


@pytest.mark.parametrize("seed", range(3))
def test_one_even_acceleration_before_a_coast_shows_no_brake(seed: int) -> None:
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 80.0, STEP)
    speed = np.interp(time, [0.0, 5.0, 23.0], [0.0, 0.0, 25.0])
    for k in np.flatnonzero(time > 23.0):
        speed[k] = max(speed[k - 1] - STEP * (130.0 + 0.36 * speed[k - 1] ** 2) / MASS, 0.0)
    pushed = (time > 5.0) & (time <= 23.0)
    torque = np.where(pushed, (MASS * 25.0 / 18.0 + 130.0 + 0.36 * speed**2) * RADIUS, 0.0)
    torque += 0.3 * rng.standard_normal(time.size)
    channels = {"speed": speed + 0.02 * rng.standard_normal(time.size), "brake_torque": np.zeros(time.size)}
    assert not unlogged_braking([(time, channels, torque)])[0].spans
