"""Axles that bounce on their tires: in the model where their masses are stated, else a cause that is found."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.effects.recovered import given
from tests.plant import cg as plant
from tests.plant.vehicle import random_vehicle
from tests.steps.cg.test_cg import logs
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.cg.known_vehicle import UNSPRUNG, known_vehicle
from vdyn_cli.steps.cg.problem import prepare
from vdyn_cli.steps.cg.spec import CgSettings, CgSpec
from vdyn_cli.steps.cg.step import STEP

SPEC = CgSpec(test="cg", settings=CgSettings(load_zero="10 N"))  # type: ignore[arg-type]
VEHICLE = random_vehicle(4)
STATED = {n: getattr(VEHICLE, n) for n in UNSPRUNG}


def known(*stated: str) -> Parameters:
    return given({**plant.known(VEHICLE), **{n: STATED[n] for n in stated}})


@pytest.mark.slow
def test_stated_masses_keep_the_pitch_inertia_unbiased() -> None:
    data = logs(VEHICLE, 4, effects={"own_axles": 1.0})
    found = {n: STEP.estimate(SPEC, data, known(*n)) for n in (UNSPRUNG, ())}
    stated, unstated = (r.parameters["pitch_inertia"] for r in found.values())
    low, high = stated.interval95
    assert low <= VEHICLE.pitch_inertia <= high
    assert abs(unstated.value - VEHICLE.pitch_inertia) > 2 * unstated.std


@pytest.mark.slow
def test_tires_that_deflect_by_9_mm_leave_the_pitch_inertia_unbiased() -> None:
    hard = replace(VEHICLE, tire_vertical_stiffness=VEHICLE.mass * 9.81 / 2 / 0.009)
    found = STEP.estimate(SPEC, logs(hard, 4, effects={"own_axles": 1.0}), known(*UNSPRUNG)).parameters["pitch_inertia"]
    low, high = found.interval95
    assert low <= hard.pitch_inertia <= high


def test_one_mass_alone_is_not_used() -> None:
    vehicle = known_vehicle(SPEC, known(UNSPRUNG[0]))
    assert [vehicle.values[n] for n in UNSPRUNG] == [0.0, 0.0]
    assert any("unsprung_mass_front is not used" in finding.what for finding in vehicle.findings)


def test_the_tires_stiffness_is_uncertain_unless_given() -> None:
    base = {**plant.known(VEHICLE), **STATED}
    assert "tire_vertical_compliance" in known_vehicle(SPEC, given(base)).nuisances
    base["tire_vertical_stiffness"] = VEHICLE.tire_vertical_stiffness
    assert "tire_vertical_compliance" not in known_vehicle(SPEC, given(base)).nuisances


@pytest.mark.slow
def test_soft_tires_and_an_assumed_drag_height_stay_physical() -> None:
    soft = replace(VEHICLE, tire_vertical_stiffness=VEHICLE.mass * 9.81 / 2 / 0.025)
    stated = {n: e for n, e in plant.known(soft).items() if n != "drag_height"}
    fit = prepare(SPEC, logs(soft, 4, effects={"own_axles": 1.0}), given({**stated, **STATED})).fit
    found = fit.solve()
    assert {"tire_vertical_compliance", "drag_height"} <= set(fit.nuisances)
    for name, (mean, std) in fit.nuisances.items():
        assert std > 0.01 * mean, name  # it is not held
        assert abs(found.values[name] - mean) < 3 * std, name
    for name in ("cg_height", "pitch_inertia"):
        low, high = found.interval95[name]
        assert low < plant.truth(soft)[name] < high, name
