"""A parameter with an interval wider than its value is withheld, except for a parameter that may have either sign."""

from __future__ import annotations

from dataclasses import replace

import pytest

from vdyn_cli.project.execute import with_warnings
from vdyn_cli.quantities.diagnosis import Diagnosis
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import FitSummary, Result


def result(half: float, name: str = "drag_area") -> Result:
    estimate = Estimate.of(name, 0.6, half / 1.96, (0.6 - half, 0.6 + half), "coastdown")
    diagnosis = Diagnosis(verdict="unknown", sentence="Unmodeled effect present.")
    fit = FitSummary(("run.csv",), 1.0, 1.0, "N", (name,))
    return Result("coastdown", "Drag area 0.6 m^2.", Parameters({name: estimate}), fit, "", diagnosis=diagnosis)


@pytest.mark.parametrize(("half", "name", "wide"), [(0.5, "drag_area", 0), (0.7, "drag_area", 1), (0.7, "tire_E", 0)])
def test_a_wide_interval_is_said_first(half: float, name: str, wide: int) -> None:
    found = with_warnings(result(half, name))
    assert len(found.fit.warnings) == wide
    assert found.sentence.startswith("Not determined: drag_area (95 % interval wider than the value)") == bool(wide)
    assert "is not conclusive" in found.sentence or not wide


def test_a_parameter_with_a_wide_interval_is_withheld_and_a_result_without_others_is_refused() -> None:
    wide = result(0.7)
    assert with_warnings(result(0.5)).parameters == result(0.5).parameters
    (refused,) = with_warnings(wide).refused
    assert "no parameter is determined" in refused.what
    known = Estimate.of("rolling_resistance", 0.01, 1e-4, (0.0098, 0.0102), "coastdown")
    found = with_warnings(replace(wide, parameters=Parameters({**wide.parameters, "rolling_resistance": known})))
    assert list(found.parameters) == ["rolling_resistance"]
    assert not found.refused
    assert "wider than its value" in found.withheld["drag_area"]


def test_a_warning_states_the_value_and_the_remedy() -> None:
    doubt = Finding(
        "run.csv, channel 'speed'", "is read in 'mph', but the file states 'km/h'", "mph", "correct it", doubt=True
    )
    (warning,) = with_warnings(replace(result(0.1), findings=(doubt,))).fit.warnings
    assert warning == str(doubt)
    assert "(got mph)" in warning
    assert warning.endswith("-> correct it")
