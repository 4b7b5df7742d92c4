"""What is hidden in bump crossings is found in its size, and the car's parameters come back to the truth."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.effects.recovered import Hidden, added, compare, given
from tests.plant import bump as plant
from tests.plant.vehicle import random_vehicle
from vdyn_cli.diagnosis.strategies.effect_unknowns import started_at
from vdyn_cli.effects import candidates
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.physics.models.half_car import LONGITUDINAL
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import load_step
from vdyn_cli.steps.bump.measured_profile import BumpData
from vdyn_cli.steps.bump.problem import BumpProblem, prepare
from vdyn_cli.steps.bump.spec import BumpSpec

pytestmark = pytest.mark.slow  # whole diagnoses or recoveries

SPEC = BumpSpec.model_validate({"test": "bump", "bump": {"height": 0.07, "width": 0.48}})
SEED = 4
VEHICLE = random_vehicle(SEED)
NAMES = ("front_load", "rear_load", "speed", "vertical_acceleration", "pitch_rate")
NO_MOTION = dict.fromkeys(LONGITUDINAL, 0.0)
HIDDEN = (
    Hidden("asymmetric_damping", 0.3),
    Hidden("suspension_friction", 120.0),
    Hidden("progressive_spring", 2.0),
    Hidden("bump_stop", 400.0),
    Hidden("tire_damping", 300.0),
    Hidden("rear_tire_stiffness", 0.2),
    Hidden("tire_enveloping", 0.12),
    Hidden("wheel_circle", 1.0),
    Hidden("bump_height_error", 0.04),
    Hidden("bump_width_error", -0.05),
    Hidden("bump_trapezoid", 0.3),
    Hidden("speed_error", 0.03),
    Hidden("clock_offset", 0.012),
    Hidden("rear_load_delay", 0.008),
    Hidden("front_load_gain", 0.05),
    Hidden("rear_load_gain", -0.04),
    Hidden("logger_filter", 0.004),
    Hidden("unsprung_mass_front_error", 0.2),
    Hidden("unsprung_mass_rear_error", -0.2),
    Hidden("pitch_inertia_error", 0.1),
)
STATED = {  # the number of the car that the description states too low by the effect
    "unsprung_mass_front_error": "unsprung_mass_front",
    "unsprung_mass_rear_error": "unsprung_mass_rear",
    "pitch_inertia_error": "sprung_pitch_inertia",
}


def stated(hidden: Hidden) -> dict[str, float]:
    """What the tester states of a car whose mass is known; one number is wrong if that is the effect."""
    right = plant.known(VEHICLE)
    wrong = dict(right)
    if name := STATED.get(hidden.plant):
        wrong[name] /= 1.0 + hidden.size
        if name.startswith("unsprung"):
            wrong["sprung_mass"] += right[name] - wrong[name]
    return wrong


@cache
def problem(hidden: Hidden, noise: float) -> BumpProblem:
    """The crossings of a car with the effect; ``noise`` is relative to the sensors'."""
    random, runs, logs = np.random.default_rng(1), plant.runs(SEED), []
    effects = {} if hidden.plant in STATED else {hidden.plant: hidden.size}
    for k, clean in enumerate(plant.noise_free(VEHICLE, runs, effects)):
        read = [clean[h] + random.normal(0, noise * s.noise, clean[h].size) for h, s in plant.SENSORS.items()]
        logs.append(Log(f"bump_{k}.csv", runs[k].times, dict(zip(NAMES, read, strict=True))))
    found = prepare(SPEC, BumpData(tuple(logs)), given(stated(hidden)))
    if noise == 1.0:
        return found
    # The plant has no fore-aft motion. Without noise, a free lever would fit how its dry friction differs from ours.
    car = found.fit.known
    std = {n: s for n, s in car.std.items() if n not in LONGITUDINAL}
    return replace(found, fit=replace(found.fit, known=replace(car, std=std, values=car.values | NO_MOTION)))


@cache
def fitted(hidden: Hidden, noise: float) -> Result:
    """The estimate with the effect in the model; its shape freed from there; at nominal where it is not determined."""
    full, shapes = added(hidden.effect), hidden.effect.nominal
    fixed = replace(full, unknowns=tuple(u for u in full.unknowns if u.name not in shapes))
    plain = problem(hidden, noise).publish(fixed)
    if not shapes:
        return plain
    found = {n: e.value for n, e in plain.amplitudes.items()}
    try:
        free = replace(full, unknowns=tuple(started_at(u, found) for u in full.unknowns))
        return problem(hidden, noise).publish(free)
    except ResultError:
        return plain


@pytest.mark.parametrize("hidden", HIDDEN, ids=str)
def test_its_size_is_found_and_the_parameters_are_the_truths(hidden: Hidden) -> None:
    result = fitted(hidden, 1.0)
    compare(result, hidden, plant.truth(VEHICLE), hidden.size, near=0.02)
    assert result.fit.rms < 1.05 * result.fit.noise_floor


@pytest.mark.thorough
@pytest.mark.parametrize("hidden", HIDDEN, ids=str)
def test_hardly_any_noise_leaves_hardly_any_error(hidden: Hidden) -> None:
    result = fitted(hidden, 0.02)
    found = result.amplitudes[next(iter(hidden.effect.unknowns))].value
    assert found == pytest.approx(hidden.size, rel=1e-3)
    # The plant's dry friction slips all at once, ours bends before it does, and bends a little like a spring.
    near = 3e-3 if hidden.plant == "suspension_friction" else 1e-3
    for name, truth in plant.truth(VEHICLE).items():
        assert result.parameters[name].value == pytest.approx(truth, rel=near), name


def test_the_step_takes_every_effect_that_it_looks_for() -> None:
    model = problem(HIDDEN[0], 1.0).model
    own = {"degressive_damping"}  # tests/effects/test_suspension_laws.py
    assert {h.plant for h in HIDDEN} | own == {
        e.name for e in applicable(model, candidates(load_step("bump").situations))
    }
