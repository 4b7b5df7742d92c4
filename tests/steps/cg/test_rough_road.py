"""Runs of which only the front axle's load is logged: heave of the body on an uneven road, and by its pitch."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant import cg as plant
from tests.plant.rough_road import road_motion
from tests.plant.vehicle import random_vehicle
from tests.steps.cg.test_cg import SPEC, known, logs
from vdyn_cli.diagnosis.diagnose import diagnosed
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.cg.driven_channels import driven_channels, driven_responses
from vdyn_cli.steps.cg.load_windows import WINDOW, cut_windows
from vdyn_cli.steps.cg.step import STEP
from vdyn_cli.steps.cg.unmeasured_heave import heave_autocovariance, pitch_heave

SEED = 4
VEHICLE = random_vehicle(SEED)


def front_only() -> tuple[Log, ...]:
    return tuple(
        Log(d.name, d.time, {n: v for n, v in d.channels.items() if n != "rear_load"}) for d in logs(VEHICLE, SEED)
    )


def rough(late: float = 0.0) -> tuple[Log, ...]:
    """The plant's runs with the road's motion added, front loads alone; the loads are logged ``late`` s too late."""
    found = []
    for k, log in enumerate(front_only()):
        road = road_motion(VEHICLE, log.time, log["speed"], np.random.default_rng([SEED, k]))
        front = np.interp(log.time - late, log.time, log["front_load"] + road.front)
        lever = VEHICLE.antenna_height - VEHICLE.cg_height
        channels = {
            "front_load": front,
            "acceleration": log["acceleration"] - lever * road.pitch_acceleration,
            "pitch_rate": log["pitch_rate"] + road.pitch_rate,
            "speed": log["speed"],
        }
        found.append(Log(log.name, log.time, channels))
    return tuple(found)


def result(late: float = 0.0) -> Result:
    given = known(VEHICLE)
    problem = STEP.prepare(SPEC, rough(late), given)
    return diagnosed(PreparedStep(STEP, SPEC, given, problem), problem.publish())


@pytest.mark.slow
def test_a_clean_day_is_adequate_and_holds_the_truth() -> None:
    found = result()
    assert found.diagnosis is not None
    assert found.diagnosis.verdict == "adequate", found.diagnosis.sentence
    for name, truth in plant.truth(VEHICLE).items():
        low, high = found.parameters[name].interval95
        assert low < truth < high, name


@pytest.mark.thorough
@pytest.mark.slow
def test_a_clock_that_is_off_is_still_named() -> None:
    found = result(late=0.05)
    assert found.diagnosis is not None
    assert [cause.effect for cause in found.diagnosis.causes] == ["clock_offset"], found.diagnosis.sentence


@pytest.mark.slow
def test_what_the_driver_causes_contains_little_of_the_road() -> None:
    driver, both = ([cut_windows(log) for log in found] for found in (front_only(), rough()))
    lever = VEHICLE.antenna_height - VEHICLE.cg_height
    responses = driven_responses(both, lever)
    found = [driven_channels(run, run.channels, lever, r) for run, r in zip(both, responses, strict=True)]
    for name in ("front_load", "pitch_rate"):
        road = np.concatenate([b.channels[name] - d.channels[name] for b, d in zip(both, driver, strict=True)])
        left = np.concatenate([f[name] - d.channels[name] for f, d in zip(found, driver, strict=True)])
        assert np.std(left) < 0.5 * np.std(road), name


def test_colored_noise_beyond_the_sensors_is_found() -> None:
    rng, count = np.random.default_rng(3), 3000
    swing = np.exp(-3.0 * WINDOW * np.arange(300)) * np.cos(2 * np.pi * 1.3 * WINDOW * np.arange(300))
    colored = [np.convolve(rng.normal(0, 10, count), swing, "same") for _ in range(4)]
    read = [c + rng.normal(0, 15, count) for c in colored]
    band = np.zeros((2, count))
    band[0] = 15.0**2
    found = heave_autocovariance(read, [band] * 4, WINDOW)
    expected = 100.0 * float(swing @ swing)
    assert found[0] == pytest.approx(expected, rel=0.15)
    spectrum = np.fft.rfft(np.concatenate([found, [0.0], found[:0:-1]])).real
    assert spectrum.min() > -1e-9 * spectrum.max()


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_levers_of_springs_and_dampers_describe_the_heave_of_a_body(seed: int) -> None:
    """Heave in proportion to the pitch acceleration, which the pitch inertia holds, leaves three times as much."""
    vehicle = random_vehicle(seed)
    run = plant.manoeuvres(seed, 1)[0]
    true = run.ride(vehicle)
    heave = true.heave_acceleration
    taken = np.column_stack([true.pitch_acceleration, true.acceleration, np.ones_like(heave)])
    swings = np.column_stack([taken, *pitch_heave(run.times, true.pitch_rate)])
    rigid, sprung = (np.std(heave - a @ np.linalg.lstsq(a, heave, rcond=None)[0]) for a in (taken, swings))
    assert sprung < rigid / 3
