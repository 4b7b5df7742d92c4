"""The elevation that a logger writes, in steps and with drift, becomes the grade that coasts feel."""

from __future__ import annotations

from time import perf_counter

import numpy as np
import pytest

from tests.coast_cases import known, log_of, solve_day, spec_of
from tests.plant import coast
from tests.plant.vehicle import random_vehicle
from vdyn_cli.io.clocks.held_values import with_held_interpolated
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.step import STEP
from vdyn_cli.steps.elevation_grade import elevation_grades

LENGTH = 1500.0  # m, of a wave of the road
STEEP = 0.012


def hilly(step: float, random: np.random.Generator) -> Log:
    """A car that rolls at 20 m/s over waves, with its elevation in steps."""
    time = np.arange(0.0, 120.0, 0.1)
    place = 20.0 * time
    height = -STEEP * LENGTH / (2 * np.pi) * np.cos(2 * np.pi * place / LENGTH) + 0.02 * random.standard_normal()
    seen = np.round(height / step) * step
    return Log("run.csv", time, {"speed": np.full(time.size, 20.0), "elevation": seen})


def test_a_grade_comes_from_steps_of_a_meter_with_its_error() -> None:
    (found,) = elevation_grades([hilly(1.0, np.random.default_rng(4))])
    true = STEEP * np.sin(2 * np.pi * found.distance / LENGTH)
    error = found.grade - true
    assert np.sqrt(np.mean(error**2)) < 0.15 * STEEP  # rounding to a meter in 83 m is worth 0.35 % a step
    stated = np.sqrt(np.sum(found.error_at(found.time) ** 2, axis=1))
    assert np.mean(np.abs(error) < 2 * stated) > 0.9


def test_finer_steps_are_more_exact() -> None:
    random = np.random.default_rng(4)
    rms = []
    for step in (1.0, 0.1):
        (found,) = elevation_grades([hilly(step, random)])
        rms.append(float(np.std(found.grade - STEEP * np.sin(2 * np.pi * found.distance / LENGTH))))
    assert rms[1] < 0.5 * rms[0]


def test_an_uncertain_lag_is_an_error_of_the_grade() -> None:
    """At 20 m/s, 0.5 s are 10 m of road."""
    (found,) = elevation_grades([hilly(0.1, np.random.default_rng(4))])
    added = found.with_lag_error(0.5).error_at(found.time)[:, -1]
    wave = STEEP * 2 * np.pi / LENGTH * np.cos(2 * np.pi * found.distance / LENGTH)
    assert np.sqrt(np.mean((added - 10.0 * wave) ** 2)) < 2.0 * wave.max()


@pytest.mark.parametrize(("decimals", "noise"), [(2, 0.15), (1, 0.1)])
def test_a_held_elevation_counts_its_own_readings_only(decimals: int, noise: float) -> None:
    """At 50 Hz, ten readings a second would look like five times as many, with an error that wanders."""
    random, time = np.random.default_rng(6), np.arange(0.0, 120.0, 0.02)
    place = 20.0 * time
    height = -STEEP * LENGTH / (2 * np.pi) * np.cos(2 * np.pi * place / LENGTH)
    seen = np.repeat(np.round(height[::5] + random.normal(0.0, noise, time.size // 5), decimals), 5)
    log = with_held_interpolated(Log("run.csv", time, {"speed": np.full(time.size, 20.0), "elevation": seen}))
    (found,) = elevation_grades([log])
    error = found.grade - STEEP * np.sin(2 * np.pi * found.distance / LENGTH)
    stated = np.sqrt(np.sum(found.error_at(found.time) ** 2, axis=1))
    assert found.prior[2] == 0.0  # no walk
    assert np.mean(np.abs(error) < 2 * stated) > 0.9
    assert np.sqrt(np.mean(stated**2)) < 2.5 * np.sqrt(np.mean(error**2))


@pytest.mark.parametrize(("rows", "speed"), [(50, 12.0), (50, 0.0), (8, 20.0)])
def test_a_short_part_of_a_run_does_not_discard_the_elevation_of_the_others(rows: int, speed: float) -> None:
    """Its own slope is that of the prior, with an error that is at most as large."""
    log = hilly(0.1, np.random.default_rng(4))
    short = {"speed": np.full(rows, speed), "elevation": log["elevation"][:rows]}
    alone, (found, part) = elevation_grades([log]), elevation_grades([log, Log("part.csv", log.time[:rows], short)])
    assert np.array_equal(found.grade, alone[0].grade)
    error = np.sqrt(np.sum(part.error_at(part.time) ** 2, axis=1))
    assert np.max(np.abs(part.grade)) < 2.0 * found.prior[1]
    assert np.all((error > 0.0) & (error < 1.01 * found.prior[1]))
    assert elevation_grades([Log("part.csv", log.time[:rows], short)]) == ()


def test_an_elevation_that_wanders_shows_the_hills_at_their_size() -> None:
    """Its error walks by 0.2 m in a second; without the walk the grade was two to four times as steep as the road."""
    random, logs = np.random.default_rng(5), []
    time = np.arange(0.0, 120.0, 0.1)
    seconds = np.arange(0.0, 121.0)
    waves = np.array([250.0, 400.0, 600.0, 1000.0])  # m
    phases = random.uniform(0.0, 2.0 * np.pi, (3, waves.size))
    for phase in phases:
        place = 20.0 * seconds
        height = 0.012 / (2 * np.pi) * np.sum(waves * np.sin(2 * np.pi * place[:, None] / waves + phase), axis=1)
        height += 0.2 * np.cumsum(random.standard_normal(seconds.size))
        seen = np.interp(time, seconds, np.round(height, 1))
        logs.append(Log("run.csv", time, {"speed": np.full(time.size, 20.0), "elevation": seen}))
    for grade, phase in zip(elevation_grades(logs), phases, strict=True):
        true = 0.012 * np.sum(np.cos(2 * np.pi * grade.distance[:, None] / waves + phase), axis=1)
        assert float(true @ grade.grade / (grade.grade @ grade.grade)) == pytest.approx(1.0, abs=0.3)
        assert np.std(grade.grade - true) < 0.6 * np.std(true)


@pytest.mark.slow  # a Monte Carlo run or several fits
def test_an_elevation_that_no_run_feels_changes_nothing() -> None:
    vehicle, random = random_vehicle(3), np.random.default_rng(9)
    plain = solve_day(vehicle, 3)
    runs = coast.campaign(vehicle, 3)
    logs = [log_of(run, f"run_{k}.csv", ("speed",)) for k, run in enumerate(runs, start=1)]
    wandering = [
        log.with_channels(elevation=np.round(100.0 + 3.0 * np.cumsum(random.standard_normal(log.time.size)) * 0.05))
        for log in logs
    ]
    found = STEP.estimate(spec_of(runs), wandering, known(vehicle, coast.DAY))
    said = "elevation is mapped but not used: the runs' decelerations do not show its slope"
    assert any(said in f.what for f in found.findings)
    for name in ("rolling_resistance", "drag_area"):
        assert found.parameters[name].value == plain.parameters[name].value


def test_the_grade_of_a_long_ride_takes_little_time() -> None:
    time = np.arange(0.0, 2400.0)
    distance = 7.0 * time
    elevation = np.round(20.0 * np.sin(distance / 300.0), 1)
    begin = perf_counter()
    (found,) = elevation_grades([Log("ride.csv", time, {"speed": np.full(time.size, 7.0), "elevation": elevation})])
    assert perf_counter() - begin < 20.0  # some 0.5 s; it took minutes with a factorization of all elevations each time
    assert np.std(found.grade - 20.0 / 300.0 * np.cos(distance / 300.0)) < 0.01
