"""A table of split times is diagnosed, though each run holds a dozen rows; its steps are no sampling rate."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.plant.other_classes import TRUCK, write_table
from vdyn_cli.project.execute import execute


def test_the_times_of_levels_are_no_clock(tmp_path: Path) -> None:
    result = execute("coastdown", write_table(tmp_path, TRUCK, 0.0, 4), level=None).result
    assert not [f for f in result.findings if "unit of time" in f.what + f.remedy or "clock" in f.what]


@pytest.mark.slow  # a diagnosis of 4 s
@pytest.mark.parametrize(("slope", "verdict"), [(0.0, "adequate"), (0.003, "named")])
def test_a_slope_is_named_from_six_columns_of_split_times(slope: float, verdict: str, tmp_path: Path) -> None:
    result = execute("coastdown", write_table(tmp_path, TRUCK, slope, 7)).result
    assert result.diagnosis.verdict == verdict
    for cause in result.diagnosis.causes:
        low, high = cause.unknowns["road_grade"].interval95
        assert low < slope < high
    low, high = result.parameters["rolling_resistance"].interval95
    assert low < TRUCK.rolling < high
