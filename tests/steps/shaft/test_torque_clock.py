"""A torque on another clock than the twist is shifted where that explains the logs."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant import shaft as plant
from tests.plant.vehicle import random_vehicle
from tests.steps.shaft.test_shaft_fit import log
from vdyn_cli.io.clocks.held_values import with_held_interpolated
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.shaft.encoder_angles import at_shifted_times
from vdyn_cli.steps.shaft.problem import prepare
from vdyn_cli.steps.shaft.shaft_readings import readings_of
from vdyn_cli.steps.shaft.spec import ShaftSpec

VEHICLE = random_vehicle(4)


def spec(delay: str = "0 ms") -> ShaftSpec:
    runs = [{"log": "tip_in.csv", "side": "left"}]
    return ShaftSpec.model_validate({"test": "shaft", "runs": runs, "settings": {"torque_delay": delay}})


@pytest.mark.parametrize("late", [0.04, pytest.param(-0.03, marks=pytest.mark.slow)])
def test_a_late_torque_is_shifted_and_the_stiffness_stays_true(late: float) -> None:
    data = log(VEHICLE, 4)
    shifted = np.interp(data.time - late, data.time, data["shaft_torque"])
    problem = prepare(spec(), (data.with_channels(shaft_torque=shifted),), Parameters())
    (said,) = (f for f in problem.log_findings if "relative to the twist" in f.what)
    assert said.fault
    side = problem.sides[0]
    assert side.torque_delay.value == pytest.approx(late, abs=3 * side.torque_delay.std)
    result = problem.publish()
    true = plant.truth(VEHICLE)["shaft_stiffness_left"]
    assert result.parameters["shaft_stiffness_left"].value == pytest.approx(true, rel=5e-3)
    damping = result.parameters.get("shaft_damping_left")
    assert damping is None or damping.interval95[0] < VEHICLE.shaft_damping_left < damping.interval95[1]


def test_a_stated_delay_that_the_log_agrees_with_stands() -> None:
    problem = prepare(spec("0.1 +- 0.2 ms"), (log(VEHICLE, 4),), Parameters())
    assert problem.sides[0].torque_delay.value == pytest.approx(1e-4)
    assert not [f for f in problem.log_findings if "relative to the twist" in f.what]


def test_an_uncertain_delay_widens_the_stiffness_to_what_the_shifted_torque_gives() -> None:
    data = log(VEHICLE, 4)
    found = [
        prepare(spec(delay), (data,), Parameters()).publish().parameters["shaft_stiffness_left"]
        for delay in ("0 ms", "2 ms", "0 +- 2 ms")
    ]
    exact, shifted, wide = found
    assert wide.value == exact.value
    assert wide.std >= 0.9 * abs(shifted.value - exact.value) > exact.std


def test_a_delay_known_to_20_ms_keeps_the_stiffness_that_a_physical_damping_allows() -> None:
    found = prepare(spec("0 +- 20 ms"), (log(VEHICLE, 4),), Parameters()).publish().parameters["shaft_stiffness_left"]
    assert found.value == pytest.approx(plant.truth(VEHICLE)["shaft_stiffness_left"], abs=3 * found.std)
    assert found.std < 0.01 * found.value


def test_a_torque_that_the_logger_held_and_received_late_is_read_at_its_own_samples() -> None:
    """Interpolated between samples of 10 ms, an oscillating torque contradicts every shaft, late or not."""
    time = np.arange(0.0, 4.0, 1e-3)
    random, stiffness, late = np.random.default_rng(7), 8000.0, 0.02
    after = np.maximum(time - 0.5, 0.0)
    twist = 0.05 * (1 - np.exp(-after / 0.5) * np.cos(2 * np.pi * 12.0 * after))
    delayed = np.interp(time - late, time, stiffness * twist + 40.0 * np.gradient(twist, time))
    torque = np.repeat((delayed + random.standard_normal(time.size))[::10], 10)
    read = Log("tip_in.csv", time, {"shaft_torque": torque, "twist": twist + 2e-5 * random.standard_normal(time.size)})
    problem = prepare(spec(), (with_held_interpolated(read),), Parameters())
    (side,) = problem.sides
    assert side.torque_delay.value == pytest.approx(late, abs=2 * side.torque_delay.std)
    found = problem.publish().parameters["shaft_stiffness_left"]
    assert found.value == pytest.approx(stiffness, rel=0.01)
    assert found.std < 0.03 * stiffness


@pytest.mark.parametrize("late", [0.03, 0.0325])
def test_an_accurate_torque_corrects_the_delay_that_a_usual_damping_gives(late: float) -> None:
    """The damping time is 1 ms: with the usual 5 ms, the delay would be 4 ms off, and the fit far off the readings."""
    time, random = np.arange(0.0, 4.0, 5e-3), np.random.default_rng(8)
    after = np.maximum(time - 0.5, 0.0)
    twist = 0.05 * (1 - np.exp(-after / 0.5) * np.cos(2 * np.pi * 9.0 * after))
    torque = np.interp(time - late, time, 8000.0 * twist + 8.0 * np.gradient(twist, time))
    noise = random.standard_normal((2, time.size))
    data = Log("tip_in.csv", time, {"shaft_torque": torque + 2.0 * noise[0], "twist": twist + 5e-5 * noise[1]})
    (side,) = prepare(spec(), (data,), Parameters()).sides
    assert side.torque_delay.value == pytest.approx(late, abs=side.torque_delay.std)


@pytest.mark.parametrize("steps", [6.0, 6.25, 6.5])
def test_a_torque_interpolated_between_its_samples_has_the_noise_of_a_mean_of_two(steps: float) -> None:
    """Neighbors share a sample: their differences would show a tenth of that noise, and delays of whole samples."""
    time, random = np.arange(0.0, 4.0, 5e-3), np.random.default_rng(8)
    after = np.maximum(time - 0.5, 0.0)
    twist = 0.05 * (1 - np.exp(-after / 0.5) * np.cos(2 * np.pi * 8.0 * after))
    late, noise = 5e-3 * steps, random.standard_normal((2, time.size))
    true = 8000.0 * twist + 40.0 * np.gradient(twist, time)
    torque = np.interp(time - late, time, true) + 10.0 * noise[0]
    data = Log("tip_in.csv", time, {"shaft_torque": torque, "twist": twist + 5e-5 * noise[1]})
    (run,) = readings_of(spec(), [data], late)["left"]
    assert run.noise[0] == pytest.approx(float(np.std(run.torque - true[: run.time.size])), rel=0.15)
    (side,) = prepare(spec(), (data,), Parameters()).sides
    assert side.torque_delay.value == pytest.approx(late, abs=1e-3)


def test_a_shift_follows_an_oscillation_between_samples_and_fills_no_gap() -> None:
    time = np.arange(400) / 200
    signal = np.sin(2 * np.pi * 8.0 * time)
    signal[100:120] = np.nan
    found = at_shifted_times(time, signal, 2.5e-3)
    assert np.isnan(found[[*range(99, 120), 399]]).all()
    inner = np.isfinite(found) & (time > 0.05) & (time < 1.95) & ((time < 0.45) | (time > 0.65))
    assert np.count_nonzero(inner) > 300
    assert np.allclose(found[inner], np.sin(2 * np.pi * 8.0 * (time[inner] + 2.5e-3)), atol=1e-4)
