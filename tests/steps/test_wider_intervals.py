"""Estimates outside the physical range are withheld, and intervals end at it."""

from __future__ import annotations

from dataclasses import replace

from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import FitSummary, Result
from vdyn_cli.steps.wider_intervals import with_wider_intervals, within_physical_range


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


def test_each_reason_for_wider_intervals_stays_in_the_sentence() -> None:
    """The open answers of a diagnosis, then stated uncertainties: the second restatement lost the first note."""
    area = Estimate.of("drag_area", 0.5, 0.1, (0.3, 0.7), "coastdown")
    result = Result("coastdown", "", Parameters({"drag_area": area}, {}), FitSummary((), 0.0, 0.0, "m/s", ()), "")
    result = replace(result, restate=lambda estimates, extra: f"Half width {estimates['drag_area'].half_width:.1f}.")
    for half, note in ((0.3, "Answers."), (0.4, "Scales."), (0.5, "Answers."), (0.5, "Nothing.")):
        wide = replace(area, interval95=(0.5 - half, 0.5 + half))
        result = with_wider_intervals(result, Parameters({"drag_area": wide}, {}), note)
    assert result.sentence == "Half width 0.5. Answers. Scales."
