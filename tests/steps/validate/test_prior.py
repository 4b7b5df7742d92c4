"""The prior of the parameters: correlations kept, consequences propagated, assumptions reported."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from tests.steps.validate.validate_cases import STD, true_parameters
from vdyn_cli.physics.models.road_load import road_load
from vdyn_cli.physics.models.vehicle import vehicle
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.parameters import Estimate, MissingParameterError, Parameters
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.validate.car.prior import parameter_prior, resistances
from vdyn_cli.steps.validate.step import STEP

VEHICLE = vehicle("front", "axle").parameters


def given(**stated: tuple[float, float]) -> Parameters:
    return Parameters({n: Estimate.given(PARAMETERS[n], v, s) for n, (v, s) in stated.items()})


def test_what_steps_gave_keeps_its_spread_and_its_correlation() -> None:
    found = parameter_prior(true_parameters(), VEHICLE)
    for name, std in STD.items():
        assert found.std[found.names.index(name)] == pytest.approx(std, rel=1e-6), name
    i, j = (found.names.index(n) for n in ("rolling_resistance", "drag_area"))
    assert found.correlation[i, j] == pytest.approx(-0.57)
    assert np.linalg.eigvalsh(found.correlation)[0] > 0
    assert found.root @ found.root.T == pytest.approx(found.correlation * np.outer(found.std, found.std))


def test_what_nobody_gave_is_assumed_widely_and_reported() -> None:
    found = parameter_prior(
        true_parameters(without=("tire_relaxation_length", "driveline_inertia", "shaft_damping_right")), VEHICLE
    )
    reported = " ".join(f.what for f in found.assumptions)
    for name in ("tire_relaxation_length", "driveline_inertia", "shaft_damping_right"):
        assert f"{name} is not given" in reported
        assert found.sources[name] == "assumed"
        assert found.std[found.names.index(name)] > 0.05 * found.values[name]
    assert all(f.minor for f in found.assumptions)


def test_a_stated_road_load_stands_for_tires_and_air() -> None:
    known = given(
        mass=(1417, 80),
        rotating_mass=(60, 15),
        gear_ratio=(9.7, 0),
        wheel_radius=(0.3405, 0),
        air_density=(1.12, 0),
        road_load_f0=(101.9, 0),
        road_load_f1=(3.443, 0),
        road_load_f2=(0.3619, 0),
    )
    found = parameter_prior(known, road_load("torque").parameters)
    assert found.values["rolling_resistance"] * 1417 * GRAVITY == pytest.approx(101.9)
    assert found.values["rolling_speed"] * 1417 * GRAVITY == pytest.approx(3.443)
    assert 0.5 * 1.12 * found.values["drag_area"] == pytest.approx(0.3619)
    # The force is stated, not its share of the weight: a heavier car has a smaller one.
    i, j = (found.names.index(n) for n in ("mass", "rolling_resistance"))
    assert found.correlation[i, j] < -0.999
    assert resistances(known) == "forces"


@pytest.mark.parametrize(("source", "expected"), [("given", "coefficients"), ("coastdown", "coasted")])
def test_coast_downs_give_a_drag_area_that_is_proportional_to_the_mass(source: str, expected: str) -> None:
    both = {
        n: Estimate.given(PARAMETERS[n], v, 0.0, source) for n, v in (("rolling_resistance", 0.01), ("drag_area", 0.6))
    }
    assert resistances(Parameters(both)) == expected


def test_the_front_half_of_the_wheelbase_follows_from_the_rear_half() -> None:
    parameters = true_parameters(without=("cg_to_front",))
    rear = Estimate.given(PARAMETERS["cg_to_rear"], 1.45, 0.001)
    known = Parameters({**parameters.estimates, "cg_to_rear": rear}, parameters.correlation)
    found = parameter_prior(known, VEHICLE)
    assert found.values["cg_to_front"] == pytest.approx(1.25)
    assert found.std[found.names.index("cg_to_front")] == pytest.approx(0.001)


def test_parts_that_do_not_add_up_are_refused() -> None:
    parameters = true_parameters()
    rear = Estimate.given(PARAMETERS["cg_to_rear"], 1.55, 0.001)
    with pytest.raises(InputError, match="do not add up to the wheelbase"):
        parameter_prior(Parameters({**parameters.estimates, "cg_to_rear": rear}), VEHICLE)


def test_missing_parameters_are_reported_before_the_logs_are_evaluated() -> None:
    """The roads of six long trips took half a minute before the mass was missed."""
    settings = SimpleNamespace(settings=SimpleNamespace(model="road_load"))
    with pytest.raises(MissingParameterError, match="mass"):
        STEP.prepare(settings, (), Parameters())


def test_a_description_without_drives_is_refused() -> None:
    settings = SimpleNamespace(settings=SimpleNamespace(model="vehicle"))
    with pytest.raises(InputError, match="no run is given"):
        STEP.prepare(settings, (), Parameters())
