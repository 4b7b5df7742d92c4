"""A tire whose law is not the magic formula: its slope is covered, and an error beside the wrong form is named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from tests.effects.recovered import added
from vdyn_cli.diagnosis.diagnose import diagnosed
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep
from vdyn_cli.effects import catalog
from vdyn_cli.inference import Solution
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.tire import problem as tire_problem
from vdyn_cli.steps.tire.binned_sweep import binned_sweep
from vdyn_cli.steps.tire.fitted_curve import FittedCurve
from vdyn_cli.steps.tire.parts import tire_parts
from vdyn_cli.steps.tire.problem import prepare
from vdyn_cli.steps.tire.spec import TireSpec
from vdyn_cli.steps.tire.step import STEP
from vdyn_cli.steps.tire.tire_regression import TireCurveProblem

SPEC = TireSpec.model_validate({"test": "tire"})
SLOPE = 22.0 * 1.05 - 0.4


def exponential(slip: np.ndarray) -> np.ndarray:
    """Friction after Burckhardt, steepest at zero slip on both sides."""
    return np.sign(slip) * (1.05 * (1.0 - np.exp(-22.0 * np.abs(slip))) - 0.4 * np.abs(slip))


def odd_in_rim_slip(slip: np.ndarray) -> np.ndarray:
    """The same friction over the slip relative to the rim's speed, which tread has when it enters the contact patch."""
    return exponential(slip / (1.0 + slip))


def sweeps(
    reach: float, slip_zero: float = 0.0, law: Callable[[np.ndarray], np.ndarray] = exponential
) -> tuple[Log, ...]:
    rng, time, logs = np.random.default_rng(5), np.arange(0.0, 12.0, 0.01), []
    for k in range(2):
        slip = reach * np.sin(2 * np.pi * time / 12.0)
        force = 4000.0 * law(slip) + 15.0 * rng.standard_normal(time.size)
        read = (1.0 + slip) * (1.0 + slip_zero) - 1.0 + 1e-3 * rng.standard_normal(time.size)
        load = 4000.0 + 15.0 * rng.standard_normal(time.size)
        logs.append(Log(f"sweep_{k}.csv", time, {"slip": read, "force_x": force, "force_z": load}))
    return tuple(logs)


@pytest.mark.slow  # three fits
def test_the_slope_of_sweeps_that_end_before_the_peak_is_covered() -> None:
    result = prepare(SPEC, sweeps(0.03), Parameters()).publish()
    assert set(result.parameters) == {"tire_longitudinal_stiffness"}
    low, high = result.parameters["tire_longitudinal_stiffness"].interval95
    assert low < SLOPE < high < low + 0.25 * SLOPE


def test_a_free_form_with_a_shape_factor_at_its_bound_holds_c(monkeypatch: pytest.MonkeyPatch) -> None:
    """Friction that hardly falls beyond its peak: the departure replaces C."""

    def bounded(fit: TireCurveProblem) -> FittedCurve:
        if fit.prior["tire_C"][1] > 0.01:
            raise ResultError("fit", "tire_C lies at its upper bound")
        return FittedCurve(fit, cast(Solution, None), None)

    monkeypatch.setattr(tire_problem, "fitted_curve", bounded)
    bare = replace(prepare(SPEC, sweeps(0.25), Parameters()).fit, begin={"tire_C": 1.7})
    assert [curve.fit.prior["tire_C"][0] for curve in tire_problem._free_forms(bare)] == [1.7, 1.7]
    with pytest.raises(ResultError, match="upper bound"):
        list(tire_problem._free_forms(replace(bare, prior={"tire_C": (1.5, 0.1)})))  # a stated one stays free


def test_sweeps_whose_shape_runs_to_a_bound_determine_the_slope() -> None:
    """A wet stretch of road drives C to its bound: the slope is published, and a note says why the shape is not."""
    logs = []
    for log in sweeps(0.25, law=lambda slip: np.sin(1.4 * np.arctan(12.0 * slip))):
        wet = (log.time > 1.5) & (log.time < 3.5)
        logs.append(log.with_channels(force_x=np.where(wet, 0.5, 1.0) * log["force_x"]))
    problem = prepare(SPEC, logs, Parameters())
    result = problem.publish()
    ((name, slope),) = result.parameters.items()
    assert name == "tire_longitudinal_stiffness"
    assert slope.interval95[0] < 1.4 * 12.0 < slope.interval95[1]
    assert result.findings[-1].what == "tire_C lies at its upper bound"
    assert problem.derived({})[name] == pytest.approx(slope.value)


@pytest.mark.slow  # two diagnoses
@pytest.mark.thorough  # 10 s
def test_a_tire_of_another_law_without_an_error_is_adequate() -> None:
    problem = prepare(SPEC, sweeps(0.25), Parameters())
    result = diagnosed(PreparedStep(STEP, SPEC, Parameters(), problem), problem.publish())
    assert result.diagnosis is not None
    assert result.diagnosis.verdict == "adequate"
    assert "departs from the magic formula" in result.diagnosis.sentence


@pytest.mark.slow  # three fits
def test_a_curve_that_is_odd_in_the_slip_of_the_rim_is_followed_in_driving_and_braking() -> None:
    result = prepare(SPEC, sweeps(0.25, law=odd_in_rim_slip), Parameters()).publish()
    low, high = result.parameters["tire_longitudinal_stiffness"].interval95
    assert low < SLOPE < high < low + 0.25 * SLOPE
    assert result.fit.rms < 1.2 * result.fit.noise_floor


def patch(slip: np.ndarray, speed: float) -> np.ndarray:
    """Friction of bristles in a contact patch, after LuGre in steady state; its slope at zero slip is ``SLOPE``."""
    sliding = np.abs(slip) + 1e-9
    level = 0.65 + 0.35 * np.exp(-np.sqrt(sliding * speed / 4.0))
    x = level / (2.0 * SLOPE * sliding)
    return np.sign(slip) * level * (1.0 - x * (1.0 - np.exp(-1.0 / x)))


@pytest.mark.thorough
@pytest.mark.slow  # four fits that converge slowly, 9 s
def test_the_slope_is_that_of_the_free_form_that_can_be_fitted() -> None:
    rng, time, logs = np.random.default_rng(8), np.arange(0.0, 18.0, 0.01), []
    for k, load in enumerate((2400.0, 3300.0, 4200.0, 5000.0)):
        speed, slip = 13.0 + 4.0 * (k % 2), 0.25 * np.sin(2 * np.pi * time / 18.0)
        read = {"slip": slip + 2e-3 * rng.standard_normal(time.size), "vehicle_speed": np.full(time.size, speed)}
        read["force_x"] = load * patch(slip, speed) + 20.0 * rng.standard_normal(time.size)
        read["force_z"] = load + 20.0 * rng.standard_normal(time.size)
        logs.append(Log(f"sweep_{k}.csv", time, read))
    fade = next(e for e in catalog() if e.name == "friction_fade")
    found = prepare(SPEC, logs, Parameters()).publish(added(fade)).parameters["tire_longitudinal_stiffness"]
    low, high = found.interval95
    assert low < SLOPE < high < low + 0.4 * SLOPE


def faded(rng: np.random.Generator) -> tuple[Log, ...]:
    """Sweeps at four rising speeds with friction that is a quarter smaller at large sliding speeds."""
    time, logs = np.arange(0.0, 9.0, 0.02), []
    for k, speed in enumerate((6.0, 12.0, 20.0, 30.0)):
        slip = 0.25 * np.sin(2 * np.pi * time / 9.0)
        friction = 1.0 - 0.25 * (1.0 - np.exp(-np.abs(slip) * speed / 3.0))
        force = 4000.0 * friction * np.sin(1.4 * np.arctan(11.0 * slip)) + 15.0 * rng.standard_normal(time.size)
        read = {"slip": slip + 1e-3 * rng.standard_normal(time.size), "vehicle_speed": np.full(time.size, speed)}
        read |= {"force_x": force, "force_z": 4000.0 + 15.0 * rng.standard_normal(time.size)}
        logs.append(Log(f"sweep_{k}.csv", time, read))
    return tuple(logs)


def test_friction_over_the_sliding_speed_is_one_curve_for_driving_and_braking() -> None:
    (sliding,) = [
        part for part in tire_parts(faded(np.random.default_rng(9)), speeds_differ=True) if part.coordinate == "sliding"
    ]
    assert sliding.span == pytest.approx((0.0, 7.5), abs=0.1)


@pytest.mark.slow  # two diagnoses
@pytest.mark.thorough  # 26 s
def test_a_wrong_zero_of_the_slip_is_named_beside_the_wrong_form() -> None:
    problem = prepare(SPEC, sweeps(0.25, 0.02), Parameters())
    result = diagnosed(PreparedStep(STEP, SPEC, Parameters(), problem), problem.publish())
    assert result.diagnosis is not None
    (cause,) = result.diagnosis.causes
    assert cause.effect == "slip_offset"
    assert cause.unknowns["slip_offset"].value == pytest.approx(0.02, abs=0.001)
    low, high = result.parameters["tire_longitudinal_stiffness"].interval95
    assert low < SLOPE < high < low + 0.25 * SLOPE


def test_the_smoothed_slip_keeps_its_slope_at_the_ends_of_a_sweep() -> None:
    samples = binned_sweep(sweeps(0.25)[0]).samples
    rate = np.gradient(samples.smooth().slip, samples.time)
    true = 0.25 * 2 * np.pi / 12.0
    assert rate[5] == pytest.approx(true, rel=0.1)
    assert rate[-6] == pytest.approx(true, rel=0.1)
