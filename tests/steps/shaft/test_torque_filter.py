"""A torque behind a low-pass filter is evaluated with twist and rate behind the same filter."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from tests.steps.shaft.test_torque_clock import spec
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.shaft.problem import prepare
from vdyn_cli.steps.shaft.shaft_readings import readings_of
from vdyn_cli.steps.shaft.torque_filter import TorqueFilter

STIFFNESS, DAMPING = 8000.0, 8.0
STEP = 5e-5  # s, of the truth
EVERY = 40  # steps between samples


def steps_of_twist() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time (s), twist (rad) and its rate (rad/s) after steps, each with a decaying oscillation at 15 Hz."""
    time = np.arange(0.0, 5.0, STEP)
    twist = np.zeros(time.size)
    for begin, size in ((0.7, 0.05), (1.9, -0.07), (3.1, 0.06)):
        later = np.maximum(time - begin, 0.0)
        twist += size * (1 - np.exp(-later / 0.12) * np.cos(2 * np.pi * 15.0 * later)) * (1 - np.exp(-later / 0.01))
    return time, twist, np.gradient(twist, STEP)


def logged(torque: np.ndarray, time: np.ndarray, twist: np.ndarray) -> Log:
    random = np.random.default_rng(5)
    at = slice(None, None, EVERY)
    read = torque[at] + 1.5 * random.standard_normal(time[at].size)
    return Log(
        "tip_in.csv",
        time[at],
        {"shaft_torque": read, "twist": twist[at] + 2e-5 * random.standard_normal(time[at].size)},
    )


@pytest.mark.parametrize(
    ("order", "corner"),
    [(2, 50.0), pytest.param(1, 30.0, marks=pytest.mark.slow), pytest.param(4, 40.0, marks=pytest.mark.slow)],
)
def test_a_filtered_torque_gives_the_true_stiffness_and_damping(order: int, corner: float) -> None:
    time, twist, rate = steps_of_twist()
    low_pass = butter(order, corner * 2 * STEP, output="sos")
    torque = sosfilt(low_pass, STIFFNESS * twist + DAMPING * rate)
    problem = prepare(spec(), (logged(torque, time, twist),), Parameters())
    (said,) = (f for f in problem.log_findings if "low-pass" in f.what)
    assert said.fault
    found = problem.publish().parameters
    for name, true in (("shaft_stiffness_left", STIFFNESS), ("shaft_damping_left", DAMPING)):
        assert abs(found[name].value - true) < 4 * found[name].std, name
    assert found["shaft_stiffness_left"].std < 0.01 * STIFFNESS
    assert found["shaft_damping_left"].std < 0.1 * DAMPING


def test_a_viscoelastic_joint_is_no_filter_and_gives_the_law_of_slow_oscillations() -> None:
    time, twist, _ = steps_of_twist()
    relaxed = sosfilt(butter(1, 2 * STEP / (2 * np.pi * 0.01), output="sos"), twist)
    torque = STIFFNESS * twist + 0.3 * STIFFNESS * (twist - relaxed)
    problem = prepare(spec(), (logged(torque, time, twist),), Parameters())
    (said,) = problem.log_findings
    assert "30 % stiffer" in said.what
    assert "10 ms" in said.what or "9.9 ms" in said.what
    assert said.doubt
    assert not said.fault
    found = problem.publish().parameters
    for name, true in (("shaft_stiffness_left", STIFFNESS), ("shaft_damping_left", 0.3 * STIFFNESS * 0.01)):
        assert abs(found[name].value - true) < 3 * found[name].std, name
    assert found["shaft_stiffness_left"].std < 0.01 * STIFFNESS


def test_a_sine_behind_a_filter_has_its_gain_and_phase() -> None:
    time = np.arange(0.0, 2.0, 2e-3)
    turn = 2 * np.pi * 20.0 * time
    run = readings_of(spec(), (Log("tip_in.csv", time, {"shaft_torque": np.sin(turn), "twist": np.sin(turn)}),), 0.0)
    read = TorqueFilter(5e-3, 1).applied(run["left"][0])
    response = 1 / (1 + 2j * np.pi * 20.0 * 5e-3)
    expected = np.abs(response) * np.sin(2 * np.pi * 20.0 * read.time + np.angle(response))
    assert read.twist[200:] == pytest.approx(expected[200:], abs=5e-4)
