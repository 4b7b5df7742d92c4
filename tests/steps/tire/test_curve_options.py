"""Options of the tire's curve: stated shape factors as priors, shifts, and a peak of its own in braking."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.plant import tire as plant
from tests.plant.vehicle import random_vehicle
from tests.steps.tire.test_tire import known, logs
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.tire.spec import TireSpec
from vdyn_cli.steps.tire.step import STEP

SEED = 4
CAR = random_vehicle(SEED)


def estimated(settings: dict[str, Any], stated: Parameters | None = None, **options: Any) -> Result:
    spec = TireSpec.model_validate({"test": "tire", "settings": settings})
    return STEP.estimate(spec, logs(CAR, SEED, **options), known(CAR).updated(stated or Parameters()))


def given(name: str, value: float, std: float = 0.0, source: str = "given") -> Parameters:
    return Parameters({name: Estimate.given(PARAMETERS[name], value, std, source)})


def test_shifts_are_found_and_do_not_bias_the_curve() -> None:
    result = estimated({"shifts": True}, effects={"slip_offset": -0.012, "vertical_shift": 0.025})
    truth = {**plant.truth(CAR), "tire_Sh": 0.012, "tire_Sv": 0.025}
    assert set(truth) == set(result.parameters)
    for name, value in truth.items():
        assert abs(result.parameters[name].value - value) < 4 * result.parameters[name].std, name


def test_driving_and_braking_have_their_own_peaks() -> None:
    result = estimated({"peaks": "two"}, effects={"braking_friction": 0.1})
    assert result.parameters["tire_D_brake"].value == pytest.approx(1.1 * CAR.tire_D, rel=5e-3)
    assert result.parameters["tire_B_brake"].value == pytest.approx(CAR.tire_B, rel=0.05)
    assert result.parameters["tire_D"].value == pytest.approx(CAR.tire_D, rel=5e-3)
    assert "in braking" in result.sentence


def test_without_the_options_there_are_no_further_parameters() -> None:
    assert not {"tire_Sh", "tire_Sv", "tire_D_brake"} & set(estimated({}).parameters)


def test_a_stated_shape_factor_is_a_prior_that_the_result_names() -> None:
    plain, told = estimated({}), estimated({}, given("tire_C", CAR.tire_C, 0.002))
    assert told.parameters["tire_C"].std < 0.0021 < plain.parameters["tire_C"].std
    assert told.parameters["tire_E"].std < plain.parameters["tire_E"].std
    (note,) = [f for f in told.findings if f.where == "tire_C"]
    assert "is a prior; the fitted value" in note.what
    assert not note.doubt


def test_a_stated_shape_factor_that_the_sweeps_contradict_is_doubted() -> None:
    told = estimated({"priors": {"tire_C": f"{CAR.tire_C + 0.1} +- 0.002"}})
    (note,) = [f for f in told.findings if f.where == "tire_C"]
    assert note.doubt


def test_a_value_without_a_standard_deviation_is_held() -> None:
    assert estimated({"priors": {"tire_E": 0.25}}).parameters["tire_E"].value == pytest.approx(0.25, abs=1e-3)


@pytest.mark.slow
def test_a_value_of_a_parameter_file_is_no_prior() -> None:
    told = estimated({}, given("tire_C", CAR.tire_C + 0.1, 0.002, source="tire"))
    assert told.parameters["tire_C"].value == pytest.approx(estimated({}).parameters["tire_C"].value)


def test_stated_c_and_e_determine_a_curve_whose_peak_was_not_reached() -> None:
    stated = {"tire_C": f"{CAR.tire_C} +- 0.05", "tire_E": f"{CAR.tire_E} +- 0.1"}
    result = estimated({"priors": stated}, peak=False)
    error = result.parameters["tire_D"].value - CAR.tire_D
    assert abs(error) < 3 * result.parameters["tire_D"].std
    assert 0.005 < result.parameters["tire_D"].std < 0.2
    assert any("depend on the stated C and E" in w for w in result.fit.warnings)
    assert np.isfinite(result.fit.rms)


@pytest.mark.slow  # a diagnosis of 3 s
def test_unlike_peaks_are_reported_where_one_curve_is_fitted() -> None:
    def told(friction: float, **settings: str) -> bool:
        found = estimated(settings, effects={"braking_friction": friction}).findings
        return any("write 'peaks: two'" in f.remedy for f in found)

    assert told(0.1)
    assert not told(0.1, peaks="two")
    assert not told(0.0)
