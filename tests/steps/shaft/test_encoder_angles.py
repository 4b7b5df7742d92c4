"""The twist of a half-shaft from the angles of two encoders."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant import shaft as plant
from tests.plant.vehicle import random_vehicle
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.shaft.encoder_angles import twist_resolution, unwrapped, with_twist_of_angles
from vdyn_cli.steps.shaft.encoder_clock import with_aligned_ends
from vdyn_cli.steps.shaft.encoder_eccentricity import with_centered_encoder
from vdyn_cli.steps.shaft.noise import ReadingConditions
from vdyn_cli.steps.shaft.shaft_readings import UNREAD_RATE, ShaftReadings, readings_of
from vdyn_cli.steps.shaft.shaft_side import ShaftSide
from vdyn_cli.steps.shaft.spec import ShaftSpec
from vdyn_cli.steps.shaft.step import STEP

CAR = random_vehicle(5)
RATIO, STEP_ANGLE = 9.7, 2 * np.pi / 65536


def angles(one_turn: bool = False) -> Log:
    """Torque and both angles of a tip-in; ``one_turn``: the wheel's encoder starts anew after each turn."""
    rng = np.random.default_rng(1)
    time = np.arange(0.0, 3.0, 1e-3)
    clean = plant.noise_free(CAR, time)
    slow, twist = clean["Wheel Speed [rad/s]"], clean["Twist [deg]"]
    wheel = np.concatenate([[0.0], np.cumsum((slow[1:] + slow[:-1]) / 2 * 1e-3)])
    motor = RATIO * (wheel + twist) + 3.0
    read = {"motor_angle": motor, "wheel_angle": np.mod(wheel, 2 * np.pi) if one_turn else wheel - 1.0}
    torque = clean["Shaft Torque [N m]"] + 1.5 * rng.standard_normal(time.size)
    return Log("tip_in.csv", time, {"shaft_torque": torque, **{n: _counted(v, rng) for n, v in read.items()}})


def _counted(angle: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return np.round((angle + 2e-5 * rng.standard_normal(angle.size)) / STEP_ANGLE) * STEP_ANGLE


def spec(ratio: float = RATIO) -> ShaftSpec:
    runs = [{"log": "tip_in.csv", "side": "left"}]
    return ShaftSpec.model_validate({"test": "shaft", "runs": runs, "settings": {"gear_ratio": ratio}})


@pytest.mark.parametrize("one_turn", [False, True])
def test_stiffness_and_damping_are_recovered(one_turn: bool) -> None:
    found = STEP.estimate(spec(), (angles(one_turn),), Parameters()).parameters
    for name in ("shaft_stiffness_left", "shaft_damping_left"):
        assert abs(found[name].value - plant.truth(CAR)[name]) < 4 * found[name].std, name
    assert found["shaft_stiffness_left"].std < 1e-3 * found["shaft_stiffness_left"].value


def test_an_eccentric_encoder_is_named_and_corrected() -> None:
    """0.1 deg once per turn: no law of the shaft explains it, and left in, it widens the stiffness's interval."""
    log = angles()
    wheel = log["wheel_angle"]
    off = log.with_channels(wheel_angle=wheel + np.radians(0.1) * np.sin(wheel + 2.0))
    result = STEP.estimate(spec(), (off,), Parameters())
    (fault,) = [f for f in result.findings if f.fault]
    assert "wheel_angle" in fault.where
    assert "+-0.1 deg once per turn" in fault.what
    stiffness = result.parameters["shaft_stiffness_left"]
    assert abs(stiffness.value - plant.truth(CAR)["shaft_stiffness_left"]) < 4 * stiffness.std
    assert stiffness.std < 1e-3 * stiffness.value
    assert not [f for f in STEP.estimate(spec(), (log,), Parameters()).findings if f.fault]


def test_a_progressive_shaft_is_no_eccentric_encoder() -> None:
    """Its residual repeats at a third of the torque's period, here once per turn, in two turns."""
    time = np.arange(0.0, 4.0, 2e-3)
    wheel = 2 * np.pi * 2.01 * time / 4.0
    torque = 100.0 + 400.0 * np.sin(wheel / 3.0 * 1.1 + 0.3)
    twist = torque / 1e4 * (1.0 - 0.3 * (torque / 400.0) ** 2)
    noise = 1e-5 * np.random.default_rng(1).standard_normal((2, time.size))
    log = Log("turns.csv", time, {"shaft_torque": torque, "motor_angle": RATIO * (wheel + twist + noise[0])})
    assert with_centered_encoder(log.with_channels(wheel_angle=wheel + noise[1]), RATIO)[1] == ()


def test_a_coarse_encoder_leaves_the_stiffness_within_its_interval() -> None:
    """96 steps of a turn: the angle rests between two steps, so that its differences do not show its error."""
    log, step = angles(), 2 * np.pi / 96
    coarse = log.with_channels(wheel_angle=np.floor(log["wheel_angle"] / step) * step)
    (run,) = readings_of(spec(), (coarse,), 0.0)["left"]
    assert run.noise[1] > 0.9 * step / 12**0.5
    found = STEP.estimate(spec(), (coarse,), Parameters()).parameters["shaft_stiffness_left"]
    low, high = found.interval95
    assert low < plant.truth(CAR)["shaft_stiffness_left"] < high


def test_a_rate_that_was_not_read_does_not_take_in_the_torques_noise() -> None:
    run = readings_of(spec(), (angles(),), 0.0)["left"][0]
    assert np.diff(run.time).mean() == pytest.approx(2e-3, rel=0.01)  # averaged to 500 Hz
    assert np.abs(run.linked(run.time**2, 2 * run.time)).max() < 1e-13
    alternating = np.resize([1.0, -1.0], run.time.size)
    assert np.abs(run.linked(np.zeros(run.time.size), alternating)[1:]).min() > 1e-3
    (noise,) = ShaftSide("left", (run,), (), None, None, 0.005, Given(0.0)).rate_noise
    assert noise < 2 * run.noise[1] / 2e-3


@pytest.mark.parametrize("rate_noise", [0.5, UNREAD_RATE])
def test_adjusted_readings_are_the_nearest_by_their_noise(rate_noise: float) -> None:
    rng = np.random.default_rng(2)
    n = 9
    time = 0.01 * np.cumsum(rng.uniform(0.8, 1.2, n))
    run = ShaftReadings("tip_in.csv", time, *rng.normal(size=(3, n)), (0.3, 0.2, rate_noise))
    conditions = ReadingConditions(run, rng.normal(size=2 * n - 1), *rng.normal(size=(2, n)))
    slopes = np.zeros((2 * n - 1, 3 * n))
    slopes[::2] = np.hstack([-np.eye(n), np.diag(conditions.to_twist), np.diag(conditions.to_rate)])
    for node, unit in enumerate(np.eye(n)):
        slopes[1::2, n + node] = run.linked(unit, np.zeros(n))
        slopes[1::2, 2 * n + node] = run.linked(np.zeros(n), unit)
    variance = np.repeat(np.square(run.noise), n)
    pulled = variance * (slopes.T @ np.linalg.solve(slopes @ (variance[:, None] * slopes.T), conditions.values))
    adjusted = np.concatenate(conditions.adjusted())
    assert np.allclose(adjusted, np.concatenate([run.twist, run.rate]) - pulled[n:], rtol=0, atol=1e-9)


def test_a_shaft_that_never_rests_shows_its_rounding_in_the_differences() -> None:
    """Each reading is 200 or more steps after the last one."""
    step, time = 2 * np.pi / 65536, np.arange(500) * 1e-3
    wheel = 20.0 * time + 100.0 * time**2
    turned = {"motor_angle": RATIO * wheel, "wheel_angle": wheel}
    log = Log("tip_in.csv", time, {n: np.floor(angle / step) * step for n, angle in turned.items()})
    assert twist_resolution(log, RATIO) == 0.0


def test_a_steady_rotation_is_no_step_of_the_encoder() -> None:
    time = np.arange(0.0, 2.0, 1e-3)
    log = Log("tip_in.csv", time, {name: 30.0 * time for name in ("motor_angle", "wheel_angle")})
    assert twist_resolution(log, 1.0) == 0.0


def test_no_torque_is_no_twist_wherever_the_encoders_count_from() -> None:
    log = with_twist_of_angles(angles(), RATIO)
    slope, zero = np.polyfit(log["shaft_torque"], log["twist"], 1)
    assert abs(zero) < 1e-9
    assert 1 / slope == pytest.approx(plant.truth(CAR)["shaft_stiffness_left"], rel=0.05)


def test_a_wrong_gear_ratio_is_named_with_the_right_one() -> None:
    with pytest.raises(InputError, match=r"write 'gear_ratio: 9\.7'") as error:
        STEP.estimate(spec(9.6), (angles(),), Parameters())
    assert "motor_angle and wheel_angle have the ratio" in str(error.value)


def test_one_angle_alone_gives_no_twist() -> None:
    log = angles()
    one = Log(log.name, log.time, {n: log[n] for n in ("shaft_torque", "motor_angle")})
    with pytest.raises(InputError, match="'motor_angle' and 'wheel_angle'"):
        STEP.estimate(spec(), (one,), Parameters())


def test_a_counter_of_turns_is_left_as_it_is() -> None:
    turns = np.array([0.0, 5.0, 10.0, np.nan, 20.0])
    assert np.array_equal(unwrapped(turns), turns, equal_nan=True)
    assert np.allclose(unwrapped(np.array([6.0, 0.1, 0.4])), [6.0, 0.1 + 2 * np.pi, 0.4 + 2 * np.pi])


@pytest.mark.parametrize("late", [0.0, 4e-3])
def test_a_motor_angle_that_is_logged_late_is_shifted(late: float) -> None:
    """4 ms at 20 rad/s is more than the twist of the tip-in."""
    log = angles()
    shifted = log.with_channels(motor_angle=np.interp(log.time - late, log.time, log["motor_angle"]))
    _, delay, said = with_aligned_ends([shifted], RATIO)
    assert bool(said) == bool(late)
    assert delay == pytest.approx(late, abs=1e-4)


def test_the_integrated_noise_of_speeds_is_no_delay() -> None:
    """It drifts as slowly as the speed changes: each delay by chance explains half of it in one log of ten."""
    time = np.arange(1200) / 200
    torque = 400 * np.sin(2 * np.pi * 0.3 * time) + 100 * np.sin(2 * np.pi * 8 * time)
    wheel = 15 + np.cumsum(torque) / 300 / 200
    motor = RATIO * (wheel + np.gradient(torque / 8000, time))
    found = []
    for seed in range(20):
        noise = np.random.default_rng(seed).standard_normal((3, time.size))
        channels = {"motor_speed": motor + 0.5 * noise[0], "wheel_speed": wheel + 0.05 * noise[1]}
        found.append(with_aligned_ends([Log("r", time, {**channels, "shaft_torque": torque + noise[2]})], RATIO)[1])
    assert not any(found)


def test_readings_that_a_wrong_law_would_move_beyond_their_noise_are_not_adjusted() -> None:
    time = np.arange(4.0)
    run = ShaftReadings("run", time, time, np.zeros(4), np.zeros(4), (1.0, 1e-3, 0.1), np.zeros(4), 0.1)
    moved = np.array([0.0, 2e-3, 4e-3, -5e-3]), np.array([0.0, 0.2, 0.5, 0.0]), np.array([0.0, 0.0, -0.2, 0.4])
    twist, rate, motor = run.within_noise(*moved)
    assert twist.tolist() == [0.0, 2e-3, 0.0, 0.0]
    assert rate.tolist() == [0.0, 0.2, 0.0, 0.0]
    assert motor.tolist() == [0.0, 0.0, -0.2, 0.0]
