"""A drag coefficient that no road vehicle has leads the result: a mass in pounds, or a speed in miles per hour."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.descriptions import described
from vdyn_cli.project.execute import execute, with_warnings
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
    result = execute("coastdown", path, level=None).result
    start = "Implausible: drag_coefficient is lower than the drag coefficient of any road vehicle"
    assert result.sentence.startswith(start) is doubted
    assert "drag_area" in result.parameters


def test_the_sentence_begins_with_a_value_that_no_vehicle_has() -> None:
    load = {
        "drag_coefficient": Estimate.of("drag_coefficient", 0.1, 0.05, (0.06, 0.18), "coastdown"),
        "rolling_resistance": Estimate.of("rolling_resistance", 0.01, 0.0003, (0.0094, 0.0106), "coastdown"),
    }
    (drag,) = implausible_values(load)
    fit = FitSummary(("a.csv",), 0.1, 0.1, "m/s", ())
    found = with_warnings(Result("coastdown", "Drag.", Parameters(load), fit, "", findings=(drag,)))
    assert (
        found.sentence
        == "Implausible: drag_coefficient is lower than the drag coefficient of any road vehicle (0.100). Drag."
    )
