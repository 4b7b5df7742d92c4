"""Corrections of inputs that are logged with a delay or a lag, with exact derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from tests.engine.plants import ROAD, ROAD_LOAD
from vdyn_cli.effects import effect
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.engine.lead import LAG, LEAD, read_ahead
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.quantities.quantity import Quantity

TIME = np.arange(0.0, 20.0, 0.02)
KNOTS, FORCE = (0.0, 3.0, 3.4, 9.0, 9.1, 20.0), (0.0, 0.0, 1500.0, 1500.0, -300.0, -300.0)


@effect(on="drive_force_lead", unknowns=(Quantity("late", "s", "delay"),), reference="none")
def late_force(lead: Law, s: Signals, q: Signals) -> Number:
    """A force that was logged late."""
    return lead(s) + q.late


@effect(on="drive_force_lag", unknowns=(Quantity("slow", "s", "time constant"),), reference="none")
def slow_force(lag: Law, s: Signals, q: Signals) -> Number:
    """A force that follows its log."""
    return lag(s) + q.slow


def drive(delay: float) -> Drive:
    force = np.interp(TIME - delay, KNOTS, FORCE)
    return Drive(TIME, {"drive_force": force, "wind": 0.0, "grade": 0.01}, {}, {}, {"heading": 1.0})


def simulator(*unknowns: str, backend: str = "auto") -> Simulator:
    return Simulator(ROAD_LOAD, ROAD, unknowns, (late_force,), backend=backend)  # type: ignore[arg-type]


def test_the_effect_is_offered():
    assert applicable(ROAD_LOAD, (late_force,)) == (late_force,)


@pytest.mark.parametrize("backend", ["llvm", "vm"])
def test_a_late_log_read_ahead_is_the_timely_log(backend):
    timely = Simulator(ROAD_LOAD, ROAD)(drive(0.0)).outputs["speed"]
    late = simulator("late", backend=backend)
    assert np.array_equal(late(drive(0.0), [0.0]).outputs["speed"], timely)
    assert late(drive(0.1), [0.1]).outputs["speed"] == pytest.approx(timely, rel=1e-12)
    assert np.abs(late(drive(0.1), [0.0]).outputs["speed"] - timely).max() > 0.05


def test_derivatives_are_those_of_the_shifted_log():
    late, step = simulator("late", "drag_area"), 1e-5
    found = late(drive(0.1), [0.05, 0.6]).sensitivities["speed"][:, 0]
    ends = [late(drive(0.1), [0.05 + h, 0.6], sensitivities=False).outputs["speed"] for h in (step, -step)]
    assert found == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-6 * np.abs(found).max())


def test_a_lead_may_be_a_fixed_parameter():
    fixed = Simulator(ROAD_LOAD, {**ROAD, "late": 0.1}, (), (late_force,))
    whole = fixed(drive(0.1)).outputs["speed"]
    assert whole == pytest.approx(simulator("late")(drive(0.1), [0.1]).outputs["speed"], rel=1e-14)


def test_what_swings_is_not_damped_by_reading_between_samples():
    """At half a sample of 10 ms a straight line would take 7 % from 12 Hz; a step must not swing."""
    time = np.arange(0.0, 2.0, 0.01)
    swing, step = np.sin(2 * np.pi * 12 * time), 1.0 * (time > 1.0)
    leads = dict.fromkeys([("swing", LEAD), ("step", LEAD)], 0.005)
    ahead = read_ahead(Drive(time, {"swing": swing, "step": step}, {}, {}, {}), leads).inputs
    inner = slice(3, -3)
    assert ahead["swing"][inner] == pytest.approx(np.sin(2 * np.pi * 12 * (time + 0.005))[inner], abs=0.02)
    assert 0.0 <= ahead["step"].min() <= ahead["step"].max() <= 1.0


def followed(time: np.ndarray, lag: float) -> np.ndarray:
    """sin(5 t) behind a first-order lag, from a start on its ramp."""
    w = 5.0
    gain, angle = 1.0 / np.hypot(1.0, lag * w), np.arctan(lag * w)
    return np.asarray(gain * np.sin(w * time - angle) + (gain * np.sin(angle) - lag * w) * np.exp(-time / lag))


@pytest.mark.parametrize("lag", [0.004, 0.06, 0.3])
def test_a_lag_is_that_of_a_low_pass_also_from_few_samples(lag):
    time = np.arange(0.0, 3.0, 0.02) + np.random.default_rng(2).uniform(-0.004, 0.004, 150)
    time -= time[0]
    seen = read_ahead(Drive(time, {"swing": np.sin(5 * time)}), {("swing", LAG): lag}).inputs["swing"]
    assert seen[2:-2] == pytest.approx(followed(time, lag)[2:-2], abs=2e-3 + 0.02 * lag)
    back = read_ahead(Drive(time, {"swing": followed(time, lag)}), {("swing", LAG): -lag}).inputs["swing"]
    late = time > 3 * lag + 0.1  # after what the start leaves
    assert back[late] == pytest.approx(np.sin(5 * time)[late], abs=0.01 + 0.1 * lag)


@pytest.mark.parametrize("lag", [-0.05, 0.0, 0.003, 0.05])
def test_derivatives_are_those_of_the_lagging_log(lag):
    both = Simulator(ROAD_LOAD, ROAD, ("slow", "late", "drag_area"), (late_force, slow_force))
    found = both(drive(0.1), [lag, 0.05, 0.6]).sensitivities["speed"]
    timely = Simulator(ROAD_LOAD, ROAD)(drive(0.0)).outputs["speed"]
    assert np.array_equal(both(drive(0.0), [0.0, 0.0, 0.6]).outputs["speed"], timely)
    for j, step in enumerate((1e-5, 1e-5)):
        ends = []
        for h in (step, 2 * step) if lag == 0.0 else (step, -step):  # two-sided derivatives agree at zero
            theta = np.array([lag, 0.05, 0.6])
            theta[j] += h
            ends.append(both(drive(0.1), theta, sensitivities=False).outputs["speed"])
        difference = (ends[0] - ends[1]) / (-step if lag == 0.0 else 2 * step)
        assert found[:, j] == pytest.approx(difference, abs=(2e-3 if lag == 0.0 else 1e-5) * np.abs(found[:, j]).max())


def test_a_missing_input_is_named():
    lacking = Drive(TIME, {"wind": 0.0, "grade": 0.0}, {}, {}, {"heading": 1.0})
    with pytest.raises(ValueError, match="drive_force"):
        simulator("late")(lacking, [0.0])
