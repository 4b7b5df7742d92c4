"""The speed as a second reading of the accelerometer: a tilt or a zero shows beside it, a delay and a gain do not."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant.vehicle import random_vehicle
from tests.steps.cg.test_cg import known, logs
from vdyn_cli.diagnosis.diagnose import diagnosed
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import published
from vdyn_cli.steps.cg.load_windows import pitch_angle
from vdyn_cli.steps.cg.logged_speed import LEAST_SLOPE, gps_zero, other_accelerometer, speed_change
from vdyn_cli.steps.cg.spec import CgSettings, CgSpec
from vdyn_cli.steps.cg.step import STEP

TILT = np.radians(1.5)
TIME = np.arange(0.0, 20.0, 0.01)
PUSH = 3.0 * np.sin(0.9 * TIME)
SPEED = 15.0 + 3.0 / 0.9 * (1.0 - np.cos(0.9 * TIME))


def residual(log: Log) -> np.ndarray:
    speed = speed_change(log)
    assert speed is not None
    return speed.rows(log["acceleration"][:, None])[:, 0]


def test_a_zero_is_a_slope_and_a_delay_or_a_gain_stays_within_the_error() -> None:
    log = Log("a.csv", TIME, {"acceleration": PUSH, "speed": SPEED})
    assert np.max(np.abs(residual(log))) < 0.1
    late = log.with_channels(speed=np.interp(TIME - 0.05, TIME, SPEED))
    assert np.sqrt(np.mean(residual(late) ** 2)) < 1.0
    louder = log.with_channels(speed=1.01 * SPEED)
    assert np.sqrt(np.mean(residual(louder) ** 2)) < 1.0
    off = residual(log.with_channels(acceleration=PUSH + 10 * LEAST_SLOPE))
    assert np.linalg.norm(off) == pytest.approx(10.0, rel=0.1)  # standard deviations of the slope


def test_a_speed_with_gaps_is_not_compared() -> None:
    holed = np.where(np.abs(TIME - 5.0) < 0.5, np.nan, SPEED)
    assert speed_change(Log("a.csv", TIME, {"acceleration": PUSH, "speed": holed})) is None
    assert speed_change(Log("a.csv", TIME, {"acceleration": PUSH})) is None


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.parametrize("tilt", [0.0, TILT])
def test_a_tilt_of_a_sensor_in_the_body_is_found_beside_a_speed(tilt: float) -> None:
    vehicle = random_vehicle(6)
    data = []
    for log in logs(vehicle, 6):
        steps = np.diff(log.time) * (log["pitch_rate"][1:] + log["pitch_rate"][:-1]) / 2
        pitch = np.concatenate([[0.0], np.cumsum(steps - steps.mean())])
        felt = log["acceleration"] * np.cos(tilt) + 9.80665 * (pitch + np.sin(tilt))
        data.append(log.with_channels(acceleration=felt))
    spec = CgSpec(test="cg", settings=CgSettings(accelerometer="body", load_zero="10 N"))  # type: ignore[arg-type]
    prepared = PreparedStep(STEP, spec, known(vehicle), STEP.prepare(spec, tuple(data), known(vehicle)))
    result = published(prepared.problem)
    assert isinstance(result, Result)
    diagnosis = diagnosed(prepared, result).diagnosis
    assert diagnosis is not None
    found = {e for one in diagnosis.ambiguous for e in one} | {c.effect for c in diagnosis.causes}
    assert ("accelerometer_tilt" in found) == (tilt > 0.0)


def accelerated_run(seed: int, zero: float, channels: tuple[str, ...] = ("speed", "acceleration")) -> Log:
    """A car that speeds up and brakes, and is a little faster in the end."""
    rng = np.random.default_rng(seed)
    speed = 12.0 - 10.0 * np.cos(2 * np.pi * TIME / 20.0) + 0.05 * TIME
    rate = np.gradient(speed, TIME)
    values = {
        "speed": speed + rng.normal(0.0, 0.03, TIME.size),
        "acceleration": rate + zero + rng.normal(0.0, 0.1, TIME.size),
    }
    return Log(f"run_{seed}.csv", TIME, {n: values[n] for n in channels})


@pytest.mark.parametrize("zero", [0.2, -0.05])
def test_a_zero_that_the_speed_contradicts_is_reported(zero: float) -> None:
    (finding,) = gps_zero([accelerated_run(k, zero) for k in range(3)])
    assert finding.doubt
    assert finding.where == "3 runs"
    assert float(finding.what.split()[2]) == pytest.approx(zero, abs=0.01)


def test_an_acceleration_that_is_the_speeds_own_rate_is_none() -> None:
    for seed in range(20):
        assert not gps_zero([accelerated_run(10 * seed + k, 0.0) for k in range(3)])
        assert not gps_zero([accelerated_run(10 * seed, 0.0)])


def test_without_a_speed_nothing_is_said() -> None:
    assert not gps_zero([accelerated_run(1, 0.5, ("acceleration",))])


def test_a_sensor_on_the_body_that_is_taken_for_an_antenna_is_reported() -> None:
    runs = logs(random_vehicle(4), 4)
    assert not other_accelerometer(runs, "gps")
    leaning = [r.with_channels(acceleration=r["acceleration"] + GRAVITY * pitch_angle(r)) for r in runs]
    (finding,) = other_accelerometer(leaning, "gps")
    assert "accelerometer: body" in finding.remedy


def test_an_antenna_that_is_taken_for_a_sensor_on_the_body_is_reported() -> None:
    runs = logs(random_vehicle(4), 4)
    assert not other_accelerometer(runs, "body")  # as evaluated for a sensor on the body: without gravity
    without = [r.with_channels(acceleration=r["acceleration"] - GRAVITY * pitch_angle(r)) for r in runs]
    (finding,) = other_accelerometer(without, "body")
    assert "accelerometer: gps" in finding.remedy
