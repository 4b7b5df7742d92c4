"""What is hidden in wheel-inertia drives is found in its size, and the inertia comes back to the truth."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.effects.recovered import Hidden, added, compare, given
from tests.plant import wheel as plant
from tests.plant.vehicle import random_vehicle
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep, setup_of
from vdyn_cli.diagnosis.name.candidate_judgment import judge
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.effects import candidates
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.inference import solve
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import load_step
from vdyn_cli.steps.inertia.problem import InertiaData, prepare
from vdyn_cli.steps.inertia.slow_noise import WINDOWS
from vdyn_cli.steps.inertia.spec import InertiaSpec

pytestmark = pytest.mark.slow  # whole diagnoses or recoveries

SPEC = InertiaSpec.model_validate({"test": "inertia", "settings": {"torque_zero": 1.0, "force_zero": 10.0}})
SEED = 1
VEHICLE = random_vehicle(SEED)
KNOWN = given(plant.known(VEHICLE))
NAMES = ("hub_torque", "wheel_speed", "hub_force_x", "hub_force_z", "acceleration", "vehicle_speed")
HIDDEN = (
    Hidden("brake_drag", 15.0),
    Hidden("brake_drag_fading", 15.0),
    Hidden("bearing_drag", 0.2),
    Hidden("bearing_warmup", 5.0),
    Hidden("wheel_windage", 1e-3),
    Hidden("hub_torque_crosstalk", 0.01),
    Hidden("hub_torque_delay", 0.02),
    Hidden("hub_torque_gain", 0.02),
    Hidden("hub_torque_lag", 0.02),
    Hidden("hub_torque_offset", 15.0),
    Hidden("torque_zero_drift", 1.0),
    Hidden("clock_offset", 0.03),
    Hidden("wheel_radius", 0.02),
    Hidden("wheel_mass", 4.0),
)


def size(hidden: Hidden) -> float:
    """In our unit: brakes that drag are given as the force at the rim."""
    return hidden.size / VEHICLE.wheel_radius if hidden.plant.startswith("brake_drag") else hidden.size


@cache
def data(hidden: Hidden, noise: float) -> InertiaData:
    random, logs = np.random.default_rng(3), []
    for k, drive in enumerate(plant.drives(SEED)):
        clean = plant.noise_free(VEHICLE, drive, {hidden.plant: hidden.size})
        read = [clean[h] + noise * s.noise * random.standard_normal(clean[h].size) for h, s in plant.SENSORS.items()]
        logs.append(Log(f"wheel_{k}.csv", drive.times, dict(zip(NAMES, read, strict=True))))
    return InertiaData(tuple(logs))


@cache
def fitted(hidden: Hidden, noise: float) -> Result:
    return prepare(SPEC, data(hidden, noise), KNOWN).publish(added(hidden.effect))


@pytest.mark.parametrize("hidden", HIDDEN, ids=str)
def test_its_size_is_found_and_the_inertia_is_the_truths(hidden: Hidden) -> None:
    result = fitted(hidden, 1.0)
    compare(result, hidden, plant.truth(VEHICLE), size(hidden), near=0.15)
    assert result.fit.rms < 1.1 * result.fit.noise_floor


@pytest.mark.parametrize("hidden", HIDDEN, ids=str)
def test_hardly_any_noise_leaves_hardly_any_error(hidden: Hidden) -> None:
    result = fitted(hidden, 0.02)
    found = result.amplitudes[next(iter(hidden.effect.unknowns))].value
    assert found == pytest.approx(size(hidden), rel=3e-3)
    assert result.parameters["wheel_inertia"].value == pytest.approx(VEHICLE.wheel_inertia, rel=1e-3)


def test_torque_and_radius_in_doubt_together_do_not_shrink_the_residual() -> None:
    """Scaling torque, radius and inertia alike must be no gain: the rows stay as they are."""
    hidden = Hidden("hub_torque_gain", 0.02)
    radius = Hidden("wheel_radius", 0.0).effect
    regression = prepare(SPEC, data(hidden, 1.0), KNOWN).regression(added(hidden.effect, radius))
    first = regression.rows(0, np.array([1.25, 0.02, 0.0, 0.0]))
    scaled = regression.rows(0, np.array([1.25 * 0.9, 1.02 / 0.9 - 1.0, 0.9 - 1.0, 0.0]))
    assert np.allclose(first.residual, scaled.residual, rtol=1e-9, atol=1e-9)


def test_the_door_finds_the_same() -> None:
    """Over the same windows: the diagnosis looks through short ones, in which a clock's offset shows."""
    hidden = Hidden("clock_offset", 0.03)
    settings = {"torque_zero": 1.0, "force_zero": 10.0, "window": f"{WINDOWS[0]} s"}
    spec = InertiaSpec.model_validate({"test": "inertia", "settings": settings})
    problem = prepare(spec, data(hidden, 1.0), KNOWN)
    found = solve(problem.regression(added(hidden.effect)))
    published = problem.publish(added(hidden.effect)).amplitudes["clock_offset"]
    assert found.values["clock_offset"] == pytest.approx(published.value, abs=0.1 * published.std)


def test_a_large_clock_offset_is_named_although_its_score_is_small() -> None:
    """Beyond the duration of pedal steps, the derivative at zero says nothing about a delay: fits also start away."""
    some = {"effects": ["clock_offset", "hub_torque_gain", "hub_torque_delay", "wheel_mass"]}
    spec = InertiaSpec.model_validate({**SPEC.model_dump(exclude_unset=True), "diagnose": some})
    found = prepare(spec, data(Hidden("clock_offset", 0.11), 1.0), KNOWN)
    judgment = judge(open_strategy(setup_of(PreparedStep(load_step("inertia"), spec, KNOWN, found))))
    assert [a.effects for a in judgment.answers] == [("clock_offset",)]
    assert judgment.answers[0].fitted.values["clock_offset"] == pytest.approx(0.11, abs=2e-3)


def test_the_step_takes_every_effect_that_it_looks_for() -> None:
    model = prepare(SPEC, data(HIDDEN[0], 1.0), KNOWN).model
    assert {h.plant for h in HIDDEN} == {e.name for e in applicable(model, candidates(load_step("inertia").situations))}
