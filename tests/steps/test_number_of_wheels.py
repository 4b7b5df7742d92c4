"""Vehicles with three wheels, or ten: the stated number turns, in every step that uses the inertia of one wheel."""

from __future__ import annotations

import pytest

from vdyn_cli.physics.models.road_load import road_load
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.cg.known_vehicle import known_vehicle
from vdyn_cli.steps.cg.spec import CgSpec
from vdyn_cli.steps.coastdown.known_parameters import known_parameters
from vdyn_cli.steps.coastdown.spec import CoastdownSpec
from vdyn_cli.steps.validate.car.prior import parameter_prior
from vdyn_cli.steps.validate.preparation import prepare
from vdyn_cli.steps.validate.spec import ValidateSpec

TRUCK = {
    **{"mass": 16_000.0, "wheel_inertia": 10.0, "wheel_radius": 0.5, "gear_ratio": 1.0, "air_density": 1.2},
    **{"rolling_resistance": 0.006, "drag_area": 5.5, "wheelbase": 5.0, "antenna_height": 2.0},
}
RUNS = [{"log": "run.csv"}]
UNITS = {"time": "s", "speed": "m/s", "drive_torque": "N m", "acceleration": "m/s^2", "front_load": "N"}


def truck(**more: float) -> Parameters:
    stated = {**TRUCK, **more}
    return Parameters({n: Estimate.given(PARAMETERS[n], v, 0.0) for n, v in stated.items()})


def channels(*names: str) -> dict[str, dict[str, str]]:
    return {n: {"column": n, "unit": UNITS[n]} for n in ("time", *names)}


@pytest.mark.parametrize(("stated", "wheels"), [({}, 4), ({"wheels": 10.0}, 10)])
def test_the_inertia_of_all_wheels_is_counted(stated: dict[str, float], wheels: int) -> None:
    known = truck(**stated)
    described = {"test": "coastdown", "channels": channels("speed"), "runs": RUNS}
    coasting = known_parameters(CoastdownSpec.model_validate(described), (), known)
    assert coasting["rotating_mass"].value == pytest.approx(wheels * 10.0 / 0.5**2)
    driven = parameter_prior(known, road_load("torque").parameters)
    assert driven.values["rotating_mass"] == pytest.approx(wheels * 10.0 / 0.5**2)
    described = {"test": "cg", "channels": channels("acceleration", "front_load"), "runs": RUNS}
    assert known_vehicle(CgSpec.model_validate(described), known).values["spin"] == pytest.approx(wheels * 10.0 / 0.5)


def test_the_model_of_single_wheels_has_four() -> None:
    described = {"test": "validate", "channels": channels("speed", "drive_torque"), "runs": RUNS}
    with pytest.raises(InputError, match="four wheels") as refused:
        prepare(ValidateSpec.model_validate(described), (), truck(wheels=3.0))
    assert "model: road_load" in str(refused.value)
