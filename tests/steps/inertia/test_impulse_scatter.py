"""Noise that is slower than the samples, and what is known within a standard deviation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.plant import wheel as plant
from tests.plant.vehicle import random_vehicle
from tests.steps.inertia.test_inertia import SPEC, changed, known, logs
from vdyn_cli.inference import solve
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.inertia.impulse_scatter import with_scatter
from vdyn_cli.steps.inertia.moment_balance import drive_windows
from vdyn_cli.steps.inertia.problem import InertiaData, prepare

VEHICLE = random_vehicle(5)
WHEEL = plant.known(VEHICLE)


def slow(log: Log, level: float, seed: int) -> Log:
    """The log with a torque noise of 50 ms, ``level`` N m."""
    keep = float(np.exp(-np.median(np.diff(log.time)) / 0.05))
    shocks = level * (1 - keep**2) ** 0.5 * np.random.default_rng(seed).standard_normal(log.time.size)
    return log.with_channels(hub_torque=log["hub_torque"] + lfilter([1.0], [1.0, -keep], shocks))


def test_white_noise_stays_as_the_samples_have_it() -> None:
    runs = [drive_windows(log, 0.25, WHEEL) for log in logs(VEHICLE, 5)]
    assert [run.noise.torque for run in with_scatter(runs, WHEEL)] == [run.noise.torque for run in runs]


def test_slow_noise_of_the_torque_is_in_the_noise_of_the_impulses() -> None:
    runs = [drive_windows(slow(log, 2.0, k), 0.25, WHEEL) for k, log in enumerate(logs(VEHICLE, 5))]
    scattered = with_scatter(runs, WHEEL)
    added = 2.0 * (2 * 0.05 / 0.25 * (1 - 0.05 / 0.25 * (1 - np.exp(-5.0)))) ** 0.5  # of a window's mean, N m
    for before, after in zip(runs, scattered, strict=True):
        spread = float(np.median(after.noise.spread)) / 0.25
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
