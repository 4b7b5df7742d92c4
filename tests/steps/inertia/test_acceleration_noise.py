"""An accelerometer that errs for longer than a sample, beside a wheel whose mass is a candidate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.plant import wheel as plant
from tests.plant.vehicle import random_vehicle
from tests.steps.inertia.test_inertia import SPEC, known, logs
from vdyn_cli.effects.wheel_mass import wheel_mass
from vdyn_cli.inference import Unknown, solve
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.inertia.acceleration_noise import with_slow_acceleration
from vdyn_cli.steps.inertia.moment_balance import drive_windows
from vdyn_cli.steps.inertia.problem import InertiaData, prepare

SLOW = 0.1  # m/s^2, of pitching and rough roads
VEHICLE = replace(random_vehicle(5), wheel_mass=35.0)
WHEEL = plant.known(VEHICLE)
HEAVIER = Unknown("wheel_mass_error", 0.0, -30.0, 30.0, "kg")


def pitching(log: Log, seed: int) -> Log:
    """The log with a noise of the acceleration of 1 s, SLOW m/s^2."""
    keep = float(np.exp(-np.median(np.diff(log.time)) / 1.0))
    shocks = SLOW * (1 - keep**2) ** 0.5 * np.random.default_rng(seed).standard_normal(log.time.size + 2000)
    return log.with_channels(acceleration=log["acceleration"] + lfilter([1.0], [1.0, -keep], shocks)[2000:])


def test_slow_noise_of_the_acceleration_is_found_against_the_wheel() -> None:
    drives = [pitching(log, k) for k, log in enumerate(logs(VEHICLE, 5))]
    runs = [drive_windows(log, 0.25, WHEEL) for log in drives]
    of_blocks = SLOW * (2 * np.exp(-1.0)) ** 0.5  # standard deviation of a mean over 1 s
    for before, after in zip(runs, with_slow_acceleration(runs, drives, WHEEL), strict=True):
        added = np.sqrt(after.noise.carried - before.noise.carried) / after.duration
        assert added == pytest.approx(of_blocks, rel=0.35)


def test_a_quiet_accelerometer_stays_quiet() -> None:
    runs = [drive_windows(log, 0.25, WHEEL) for log in logs(VEHICLE, 5)]
    for run in with_slow_acceleration(runs, logs(VEHICLE, 5), WHEEL):
        assert np.max(np.sqrt(run.noise.carried) / run.duration) < 0.015


def test_a_run_too_short_for_blocks_stays_as_it_is() -> None:
    drives = [log.between(0.0, 5.0) for log in logs(VEHICLE, 5)[:1]]
    runs = tuple(drive_windows(log, 0.25, WHEEL) for log in drives)
    assert with_slow_acceleration(runs, drives, WHEEL) == runs


def test_a_noisy_accelerometer_makes_no_wheel_lighter() -> None:
    found = []
    for seed in range(1, 7):
        drives = tuple(pitching(log, 10 * seed + k) for k, log in enumerate(logs(VEHICLE, seed)))
        fit = solve(prepare(SPEC, InertiaData(drives), known(VEHICLE)).regression((wheel_mass,), (HEAVIER,)))
        found.append((fit.values["wheel_mass_error"], fit.std["wheel_mass_error"]))
    errors, deviations = np.array(found).T
    assert abs(np.mean(errors)) < 3 * np.mean(deviations) / len(errors) ** 0.5
