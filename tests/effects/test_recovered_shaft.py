"""What is hidden in a tip-in is found in its size, and the shaft comes back to the truth."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.effects.recovered import Hidden, added, compare, given
from tests.plant import shaft as plant
from tests.plant.vehicle import random_vehicle
from vdyn_cli.effects import candidates
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.inference import solve
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import load_step
from vdyn_cli.steps.shaft.problem import prepare
from vdyn_cli.steps.shaft.spec import ShaftSpec

pytestmark = pytest.mark.slow  # whole diagnoses or recoveries

SEED = 2
VEHICLE = random_vehicle(SEED)
KNOWN = given({})
NAMES = ("shaft_torque", "motor_speed", "wheel_speed", "twist")
HIDDEN = (
    Hidden("series_compliance", 2e-5),
    Hidden("backlash", 2e-3),
    Hidden("backlash", 1e-2),
    Hidden("torque_zero_drift", 1.0),
    Hidden("inertia_before_shaft", 1.5),
)
QUIET = Hidden("shaft_friction", 20.0)  # its reversals show only in a twist with little noise


def spec(drawn: bool) -> ShaftSpec:
    """A tip-in of the left shaft, with its drawing where that is needed."""
    sections = [
        {"outer_diameter": s.outer_diameter, "length": s.length}
        | ({"inner_diameter": s.inner_diameter} if s.inner_diameter else {})
        for s in plant.drawing(VEHICLE, "left")
    ]
    modulus = f"{VEHICLE.shear_modulus} +- {0.003 * VEHICLE.shear_modulus} Pa"
    runs = [{"log": "tip_in.csv", "side": "left"}]
    entries = {"test": "shaft", "runs": runs, "shear_modulus": modulus}
    return ShaftSpec.model_validate(entries | ({"sections": {"left": sections}} if drawn else {}))


@cache
def log(hidden: Hidden, noise: float) -> Log:
    random = np.random.default_rng(3)
    times = plant.jitter(plant.regular(4.0, plant.RATE), 0.05, random)
    clean = plant.noise_free(VEHICLE, times, {hidden.plant: hidden.size})
    read = [clean[h] + noise * s.noise * random.standard_normal(times.size) for h, s in plant.SENSORS.items()]
    return Log("tip_in.csv", times, dict(zip(NAMES, read, strict=True)))


def stiffness(hidden: Hidden) -> float:
    """Stiffness of the shaft with the joints, if any."""
    bar = plant.truth(VEHICLE)["shaft_stiffness_left"]
    return bar / (1 + bar * hidden.size) if hidden.plant == "series_compliance" else bar


@cache
def fitted(hidden: Hidden, noise: float) -> Result:
    how = spec(drawn=hidden.plant == "series_compliance")
    return prepare(how, (log(hidden, noise),), KNOWN).publish(added(hidden.effect))


@pytest.mark.parametrize("hidden", HIDDEN, ids=str)
def test_its_size_is_found_and_the_shaft_is_the_truths(hidden: Hidden) -> None:
    result = fitted(hidden, 1.0)
    compare(result, hidden, {"shaft_stiffness_left": stiffness(hidden)}, hidden.size, near=0.05)
    # The plant's flanks push and never pull, not even by the damping of the bar between them.
    assert result.fit.rms < 1.05 * result.fit.noise_floor


@pytest.mark.parametrize("hidden", [*HIDDEN, QUIET], ids=str)
def test_hardly_any_noise_leaves_hardly_any_error(hidden: Hidden) -> None:
    result = fitted(hidden, 0.02)
    found = result.amplitudes[next(iter(hidden.effect.unknowns))].value
    assert found == pytest.approx(hidden.size, rel=1e-3 if hidden.plant == "series_compliance" else 0.02)
    assert result.parameters["shaft_stiffness_left"].value == pytest.approx(stiffness(hidden), rel=5e-3)


@pytest.mark.parametrize("hidden", HIDDEN, ids=str)
def test_the_door_finds_the_same(hidden: Hidden) -> None:
    how = spec(drawn=hidden.plant == "series_compliance")
    regression = prepare(how, (log(hidden, 1.0),), KNOWN).regression(added(hidden.effect))
    found = solve(regression, tolerance=1e-3)
    name = next(iter(hidden.effect.unknowns))
    published = fitted(hidden, 1.0).amplitudes[name]
    assert found.values[name] == pytest.approx(published.value, abs=published.std)
    assert [u.name for u in regression.shared] == ["shaft_stiffness_left", "shaft_damping_left", name]


def test_both_sides_share_the_effects_and_have_a_bar_each() -> None:
    hidden = HIDDEN[1]
    logs = (log(hidden, 1.0), log(hidden, 1.0))
    runs = [{"log": "tip_in.csv", "side": side} for side in ("left", "right")]
    how = ShaftSpec.model_validate({"test": "shaft", "runs": runs})
    regression = prepare(how, logs, KNOWN).regression(added(hidden.effect))
    found = solve(regression, tolerance=1e-3).values
    assert found["shaft_stiffness_left"] == pytest.approx(found["shaft_stiffness_right"], rel=1e-6)
    assert found["backlash"] == pytest.approx(hidden.size, rel=0.05)


def offered(noise: float) -> set[str]:
    model = prepare(spec(False), (log(QUIET, noise),), KNOWN).model
    return {e.name for e in applicable(model, candidates(load_step("shaft").situations))}


def test_the_step_takes_every_effect_that_it_looks_for() -> None:
    assert offered(0.02) == {h.plant for h in (*HIDDEN, QUIET)}


def test_friction_is_tested_only_where_the_twist_shows_its_reversals() -> None:
    """With 52 microrad of noise, 20 N m of friction would be found as 17."""
    assert offered(1.0) == {h.plant for h in HIDDEN}
