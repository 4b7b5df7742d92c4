"""A drag coefficient that no road vehicle has is no result: a mass in pounds, or a speed in miles per hour."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.descriptions import described
from vdyn_cli.project.execute import RefusedResultError, execute, with_warnings
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import FitSummary, Result
from vdyn_cli.steps.coastdown.doubts.result_doubts import implausible_values


@pytest.mark.slow
@pytest.mark.parametrize(("mass", "doubted"), [("1588 lb", True), ("1588 kg", False)])
def test_a_mass_in_the_wrong_unit_shows_in_the_drag_coefficient(
    root: Path, tmp_path: Path, mass: str, doubted: bool
) -> None:
    vehicle = f"vehicle: {{mass: {mass}, rotating_mass: 60 kg, frontal_area: 2.19 m^2}}"
    path = described(tmp_path, root, "coastdown", (f"vehicle: {root / 'configs' / 'vehicle.yaml'}", vehicle))
    if not doubted:
        assert "drag_coefficient" in execute("coastdown", path, level=None).result.parameters
        return
    with pytest.raises(RefusedResultError, match="lower than the drag coefficient of any road vehicle") as error:
        execute("coastdown", path, level=None)
    result = error.value.record.result
    assert result.sentence.startswith("Implausible: drag_coefficient is lower than")
    assert "drag_area" in result.withheld
    assert "drag_area" not in result.parameters


def test_an_interval_with_a_plausible_value_is_published() -> None:
    load = {
        "drag_coefficient": Estimate.of("drag_coefficient", 0.1, 0.05, (0.06, 0.18), "coastdown"),
        "rolling_resistance": Estimate.of("rolling_resistance", 0.001, 0.0003, (0.0007, 0.0013), "coastdown"),
    }
    drag, rolling = implausible_values(load)
    fit = FitSummary(("a.csv",), 0.1, 0.1, "m/s", ())
    result = Result("coastdown", "Drag.", Parameters(load).without(["rolling_resistance"]), fit, "", findings=(drag,))
    found = with_warnings(result)
    assert (
        found.sentence
        == "Implausible: drag_coefficient is lower than the drag coefficient of any road vehicle (0.100). Drag."
    )
    assert not found.refused
    refused = with_warnings(replace(result, parameters=Parameters(load), findings=(rolling,)))
    assert [f.where for f in refused.refused] == ["rolling_resistance"]
    assert not refused.parameters
