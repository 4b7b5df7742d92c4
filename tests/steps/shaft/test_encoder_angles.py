"""The twist of a half-shaft from the angles of two encoders."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant import shaft as plant
from tests.plant.vehicle import random_vehicle
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.shaft.encoder_angles import unwrapped, with_twist_of_angles
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


def test_no_torque_is_no_twist_wherever_the_encoders_count_from() -> None:
    log = with_twist_of_angles(angles(), RATIO)
    slope, zero = np.polyfit(log["shaft_torque"], log["twist"], 1)
    assert abs(zero) < 1e-9
    assert 1 / slope == pytest.approx(plant.truth(CAR)["shaft_stiffness_left"], rel=0.05)


def test_a_wrong_gear_ratio_is_named_with_the_right_one() -> None:
    with pytest.raises(InputError, match=r"write 'gear_ratio: 9\.7'") as error:
        STEP.estimate(spec(9.6), (angles(),), Parameters())
    assert "motor_angle over wheel_angle is not the gear ratio" in str(error.value)


def test_one_angle_alone_gives_no_twist() -> None:
    log = angles()
    one = Log(log.name, log.time, {n: log[n] for n in ("shaft_torque", "motor_angle")})
    with pytest.raises(InputError, match="'motor_angle' and 'wheel_angle'"):
        STEP.estimate(spec(), (one,), Parameters())


def test_a_counter_of_turns_is_left_as_it_is() -> None:
    turns = np.array([0.0, 5.0, 10.0, np.nan, 20.0])
    assert np.array_equal(unwrapped(turns), turns, equal_nan=True)
    assert np.allclose(unwrapped(np.array([6.0, 0.1, 0.4])), [6.0, 0.1 + 2 * np.pi, 0.4 + 2 * np.pi])
