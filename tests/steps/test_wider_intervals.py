"""Estimates outside the physical range are withheld, and intervals end at it."""

from __future__ import annotations

from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import FitSummary, Result
from vdyn_cli.steps.wider_intervals import within_physical_range


def test_an_impossible_estimate_is_withheld_and_an_interval_ends_at_the_range() -> None:
    """Other steps, ``compare`` and ``export`` refuse a file with a drag coefficient of 0.04."""
    area = Estimate.of("drag_area", 0.08, 0.03, (-0.4, 0.5), "coastdown")
    coefficient = Estimate.of("drag_coefficient", 0.04, 0.01, (-0.2, 0.3), "coastdown")
    related = {"drag_area": {"drag_area": 1.0, "drag_coefficient": 1.0}, "drag_coefficient": {"drag_area": 1.0}}
    found = Parameters({"drag_area": area, "drag_coefficient": coefficient}, related)
    result = within_physical_range(Result("coastdown", "", found, FitSummary((), 0.0, 0.0, "m/s", ()), ""))
    assert list(result.parameters) == ["drag_area"]
    assert result.parameters.correlation == {"drag_area": {"drag_area": 1.0}}
    assert result.parameters["drag_area"].interval95 == (0.05, 0.5)
    assert result.withheld == {"drag_coefficient": "its estimate of 0.04 is outside the physical range, 0.05 to 2.5"}
