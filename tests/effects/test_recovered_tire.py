"""What is hidden in slip sweeps is found in its size, and the curve comes back to the truth."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.effects.recovered import Hidden, added, compare, given
from tests.plant import tire as plant
from tests.plant.vehicle import random_vehicle
from vdyn_cli.effects import candidates
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.inference import solve
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import load_step
from vdyn_cli.steps.tire.problem import prepare
from vdyn_cli.steps.tire.spec import TireSpec

pytestmark = pytest.mark.slow  # whole diagnoses or recoveries

SPEC = TireSpec.model_validate({"test": "tire"})
SEED = 2
VEHICLE = random_vehicle(SEED)
KNOWN = given(plant.known(VEHICLE))
NAMES = ("wheel_speed", "vehicle_speed", "force_x", "force_z")
HIDDEN = (
    Hidden("load_sensitivity", 2e-5),
    Hidden("slip_offset", 0.004),
    Hidden("force_offset", 80.0),
    Hidden("load_offset", 120.0),
    Hidden("rolling_force", 0.013),
    Hidden("tire_relaxation", 0.3),
    Hidden("friction_fade", 0.01),
    Hidden("braking_friction", 0.08),
    Hidden("vertical_crosstalk", 0.02),
)


@cache
def logs(hidden: Hidden, noise: float) -> tuple[Log, ...]:
    random, found = np.random.default_rng(3), []
    for k, sweep in enumerate(plant.sweeps(VEHICLE, SEED)):
        clean = plant.noise_free(VEHICLE, sweep, {hidden.plant: hidden.size})
        read = [clean[h] + noise * s.noise * random.standard_normal(clean[h].size) for h, s in plant.SENSORS.items()]
        found.append(Log(f"slip_{k}.csv", sweep.times, dict(zip(NAMES, read, strict=True))))
    return tuple(found)


@cache
def fitted(hidden: Hidden, noise: float) -> Result:
    return prepare(SPEC, logs(hidden, noise), KNOWN).publish(added(hidden.effect))


def truth(hidden: Hidden) -> dict[str, float]:
    """The curve at the sweeps' mean load, where ours is meant; the plant's is at the static load."""
    values = plant.truth(VEHICLE)
    if hidden.plant == "load_sensitivity":
        mean = float(np.mean(np.concatenate([log["force_z"] for log in logs(hidden, 1.0)])))
        less = 1.0 - hidden.size * (mean - VEHICLE.front_load / 2)
        values |= {n: values[n] * less for n in ("tire_D", "tire_longitudinal_stiffness")}
    return values


@pytest.mark.parametrize("hidden", HIDDEN, ids=str)
def test_its_size_is_found_and_the_curve_is_the_truths(hidden: Hidden) -> None:
    result = fitted(hidden, 1.0)
    compare(result, hidden, truth(hidden), hidden.size, near=0.15)
    assert result.fit.rms < 1.15 * result.fit.noise_floor


@pytest.mark.thorough  # as those of the other steps
@pytest.mark.parametrize("hidden", HIDDEN, ids=str)
def test_hardly_any_noise_leaves_hardly_any_error(hidden: Hidden) -> None:
    result = fitted(hidden, 0.02)
    found = result.amplitudes[next(iter(hidden.effect.unknowns))]
    # A slip that lags is taken to first order in the length, and in the mean of each bin. The noise that is left is
    # 2 % of a rolling resistance. The curve's corner between braking and driving lies inside a bin.
    near = {"tire_relaxation": 1e-2, "braking_friction": 2e-2}.get(hidden.plant, 5e-3)
    assert found.value == pytest.approx(hidden.size, rel=near, abs=found.std)
    for name in ("tire_B", "tire_C", "tire_D", "tire_longitudinal_stiffness"):
        assert result.parameters[name].value == pytest.approx(truth(hidden)[name], rel=5e-3), name


def test_the_door_finds_the_same() -> None:
    hidden = Hidden("slip_offset", 0.004)
    problem = prepare(SPEC, logs(hidden, 1.0), KNOWN)
    found = solve(problem.regression(added(hidden.effect)))
    published = fitted(hidden, 1.0).amplitudes["slip_offset"]
    assert found.values["slip_offset"] == pytest.approx(published.value, abs=0.1 * published.std)


def test_the_step_takes_every_effect_that_it_looks_for_and_without_a_speed_what_needs_none() -> None:
    sweeps = logs(HIDDEN[0], 1.0)
    wanted = candidates(load_step("tire").situations)
    # tests/steps/tire/test_named_faults.py
    own = {"friction_drift", "tread_wear", "slip_lag", "ground_speed_delay", "rolling_radius_growth"}
    assert {h.plant for h in HIDDEN} | own == {e.name for e in applicable(prepare(SPEC, sweeps, KNOWN).model, wanted)}
    slips = tuple(
        Log(s.name, s.time, {"slip": s["slip"], "force_x": s["force_x"], "force_z": s["force_z"]})
        for s in prepare(SPEC, sweeps, KNOWN).logs
    )
    names = {e.name for e in applicable(prepare(SPEC, slips, KNOWN).model, wanted)}
    expected = {"load_sensitivity", "slip_offset", "force_offset", "rolling_force", "friction_drift", "slip_lag"}
    expected |= {"braking_friction", "tread_wear", "load_offset", "vertical_crosstalk"}
    assert names == expected
