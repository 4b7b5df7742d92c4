"""Noise that is slower than the samples, and what is known within a standard deviation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.plant import wheel as plant
from tests.plant.vehicle import random_vehicle
from tests.steps.inertia.test_inertia import SPEC, changed, known, logs
from vdyn_cli.effects.wheel_mass import wheel_mass
from vdyn_cli.inference import Unknown, solve
from vdyn_cli.inference.banded import whitened
from vdyn_cli.io.clocks.held_values import with_held_interpolated
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.inertia.drive_checks import too_little
from vdyn_cli.steps.inertia.moment_balance import drive_windows
from vdyn_cli.steps.inertia.problem import InertiaData, prepare
from vdyn_cli.steps.inertia.slow_noise import HUB, likeliest_delay, with_scatter, with_slow_acceleration

SLOW = 0.1  # m/s^2, of pitching and rough roads
VEHICLE = random_vehicle(5)
HEAVY = replace(VEHICLE, wheel_mass=35.0)
HEAVIER = Unknown("wheel_mass_error", 0.0, -30.0, 30.0, "kg")


def colored(log: Log, channel: str, size: float, seconds: float, seed: int) -> Log:
    """The log with noise of this standard deviation and correlation time in one channel."""
    keep = float(np.exp(-np.median(np.diff(log.time)) / seconds))
    shocks = size * (1 - keep**2) ** 0.5 * np.random.default_rng(seed).standard_normal(log.time.size + 2000)
    return log.with_channels(**{channel: log[channel] + lfilter([1.0], [1.0, -keep], shocks)[2000:]})


def pitching(log: Log, seed: int) -> Log:
    """The log with a noise of the acceleration of 1 s, SLOW m/s^2."""
    return colored(log, "acceleration", SLOW, 1.0, seed)


@pytest.mark.parametrize(("lag", "jitter"), [(0.0, 1.0), (0.004, 0.0)])
def test_the_covariance_of_impulses_is_that_of_the_integrated_samples(lag: float, jitter: float) -> None:
    """Readings at the edges enter once more where their low-pass filter is corrected, exactly so at even steps."""
    log = logs(VEHICLE, 5)[0]
    even = np.linspace(log.time[0], log.time[-1], log.time.size)
    run = drive_windows(replace(log, time=even + jitter * (log.time - even)), 0.12, plant.known(VEHICLE))
    inertia, moment, size = 1.3, 7.0, run.log.time.size
    steps = np.diff(run.log.time)
    integral, gained = (np.zeros((run.first.size, size)) for _ in range(2))
    for k, (first, last) in enumerate(zip(run.first, run.last, strict=True)):
        for i in range(first, last):
            integral[k, i : i + 2] += steps[i] / 2
        gained[k, last], gained[k, first] = 1.0, -1.0
    noise = replace(run.noise, reading=run.noise.torque)  # of the torque alone, of which the filter is corrected
    exact = noise.torque**2 * (integral + lag * gained) @ (integral + lag * gained).T
    exact += (moment * noise.acceleration) ** 2 * integral @ integral.T
    exact += (inertia * noise.speed) ** 2 * gained @ gained.T
    rows = whitened(noise.factor(inertia, moment, lag), np.eye(run.first.size))
    assert rows @ exact @ rows.T == pytest.approx(np.eye(run.first.size), abs=1e-9)


def test_white_noise_stays_as_the_samples_have_it() -> None:
    wheel = plant.known(VEHICLE)
    runs = [drive_windows(log, 0.25, wheel) for log in logs(VEHICLE, 5)]
    assert [run.noise.torque for run in with_scatter(runs, wheel)] == [run.noise.torque for run in runs]


def test_slow_noise_of_the_torque_is_in_the_noise_of_the_impulses() -> None:
    wheel = plant.known(VEHICLE)
    drives = [colored(log, "hub_torque", 2.0, 0.05, k) for k, log in enumerate(logs(VEHICLE, 5))]
    runs = [drive_windows(log, 0.25, wheel) for log in drives]
    added = 2.0 * (2 * 0.05 / 0.25 * (1 - 0.05 / 0.25 * (1 - np.exp(-5.0)))) ** 0.5  # of a window's mean, N m
    for before, after in zip(runs, with_scatter(runs, wheel), strict=True):
        spread = float(np.median(after.noise.squares)) ** 0.5 / 0.25
        found = (after.noise.torque**2 - before.noise.torque**2) ** 0.5 * spread
        assert found == pytest.approx(added, rel=0.35)


@pytest.mark.parametrize("sign", [-1, 1])
def test_a_radius_within_its_stated_deviation_is_corrected_by_the_balance(sign: int) -> None:
    radius = VEHICLE.wheel_radius * (1 + 0.004 * sign)
    given = changed(known(VEHICLE, wheel_radius=0.003 * radius), wheel_radius=radius)
    problem = prepare(SPEC, InertiaData(logs(VEHICLE, 5)), given)
    found = solve(problem.regression())
    assert found.values["wheel_radius"] == pytest.approx(VEHICLE.wheel_radius, abs=3 * found.std["wheel_radius"])
    assert found.std["wheel_radius"] < 0.003 * radius
    assert found.values["wheel_inertia"] == pytest.approx(VEHICLE.wheel_inertia, abs=3 * found.std["wheel_inertia"])


def test_slow_noise_of_the_acceleration_is_found_against_the_wheel() -> None:
    drives = [pitching(log, k) for k, log in enumerate(logs(HEAVY, 5))]
    runs = [drive_windows(log, 0.25, plant.known(HEAVY)) for log in drives]
    of_blocks = SLOW * (2 * np.exp(-1.0)) ** 0.5  # standard deviation of a mean over 1 s
    for before, after in zip(runs, with_slow_acceleration(runs, drives, plant.known(HEAVY)), strict=True):
        added = np.sqrt(after.noise.slow - before.noise.slow) / after.duration
        assert added == pytest.approx(of_blocks, rel=0.35)


def test_a_quiet_accelerometer_stays_quiet() -> None:
    runs = [drive_windows(log, 0.25, plant.known(HEAVY)) for log in logs(HEAVY, 5)]
    for run in with_slow_acceleration(runs, logs(HEAVY, 5), plant.known(HEAVY)):
        assert np.max(np.sqrt(run.noise.acceleration**2 * run.noise.squares + run.noise.slow) / run.duration) < 0.015


def test_late_channels_of_the_hub_are_no_noise_of_the_accelerometer() -> None:
    """The slip is computed from forces that are read when the speed was: unshifted, it gives 0.017 m/s^2."""
    drives = [
        log.with_channels(**{n: np.interp(log.time - 0.04, log.time, log[n]) for n in HUB}) for log in logs(HEAVY, 5)
    ]
    runs = [drive_windows(log, 0.25, plant.known(HEAVY)) for log in drives]
    for run in with_slow_acceleration(runs, drives, plant.known(HEAVY)):
        assert likeliest_delay(run, plant.known(HEAVY)) == pytest.approx(0.04)
        assert np.max(np.sqrt(run.noise.slow) / run.duration) < 0.015


def test_a_wheel_that_spins_once_is_no_noise_of_the_accelerometer() -> None:
    """By least squares, the blocks in which it spins 5 % faster give the accelerometer 0.047 m/s^2."""
    drives = [
        log.with_channels(wheel_speed=log["wheel_speed"] * (1 + 0.05 * np.exp(-(((log.time - 15.0) / 0.6) ** 2))))
        for log in logs(HEAVY, 5)
    ]
    runs = [drive_windows(log, 0.25, plant.known(HEAVY)) for log in drives]
    for run in with_slow_acceleration(runs, drives, plant.known(HEAVY)):
        assert np.max(np.sqrt(run.noise.slow) / run.duration) < 0.015


def test_a_run_too_short_for_blocks_stays_as_it_is() -> None:
    drives = [log.between(0.0, 5.0) for log in logs(HEAVY, 5)[:1]]
    runs = tuple(drive_windows(log, 0.25, plant.known(HEAVY)) for log in drives)
    assert with_slow_acceleration(runs, drives, plant.known(HEAVY)) == runs


@pytest.mark.slow
def test_a_noisy_accelerometer_makes_no_wheel_lighter() -> None:
    found, heavier = [], AddedEffects((wheel_mass,), (HEAVIER,))
    for seed in range(1, 7):
        drives = tuple(pitching(log, 10 * seed + k) for k, log in enumerate(logs(HEAVY, seed)))
        fit = solve(prepare(SPEC, InertiaData(drives), known(HEAVY)).regression(heavier))
        found.append((fit.values["wheel_mass_error"], fit.std["wheel_mass_error"]))
    errors, deviations = np.array(found).T
    assert abs(np.mean(errors)) < 3 * np.mean(deviations) / len(errors) ** 0.5


def test_windows_end_where_a_slower_speed_sensor_sampled() -> None:
    """Between its samples the speed is interpolated: their noise is that of a reading, and every edge has one."""
    (log, *_), wheel = logs(VEHICLE, 5), plant.known(VEHICLE)
    rows = np.arange(0, log.time.size, 10)
    held = log["wheel_speed"].copy()
    for row, following in zip(rows, [*rows[1:], held.size], strict=True):
        held[row:following] = held[row]
    slow = with_held_interpolated(log.with_channels(wheel_speed=held))
    every, run = (drive_windows(each, 0.25, wheel) for each in (log, slow))
    assert np.isin(np.concatenate([run.first, run.last]), rows).all()
    assert run.noise.speed == pytest.approx(every.noise.speed, rel=0.3)


def test_a_run_with_few_readings_of_a_slow_speed_sensor_is_refused() -> None:
    log = logs(VEHICLE, 5)[0]
    time = np.arange(log.time[0], log.time[-1], 1.0)
    read = np.interp(time, log.time, log["wheel_speed"])
    slow = log.with_channels(wheel_speed=np.interp(log.time, time, read))
    part = replace(slow, samples={"wheel_speed": (time, read)}).between(log.time[0], log.time[0] + 5.0)
    (found,) = too_little(drive_windows(part, 0.25, plant.known(VEHICLE)))
    assert "12 are needed" in found.what


def test_a_clock_offset_of_the_hub_is_not_noise_of_its_torque() -> None:
    wheel = plant.known(VEHICLE)
    levels = []
    for late in (0.0, 0.1):
        runs = [drive_windows(log, 0.125, wheel) for log in logs(VEHICLE, 5, {"clock_offset": late})]
        levels.append([run.noise.torque for run in with_scatter(runs, wheel)])
    assert levels[1] == pytest.approx(levels[0], rel=0.1)
