"""Trips of an electric car against its certified road load: the simulated car runs too fast."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.bench.bmw_windows import validated


@pytest.mark.parametrize(
    ("season", "windows"), [pytest.param("summer", 30, marks=[pytest.mark.slow, pytest.mark.thorough]), ("winter", 20)]
)
def test_the_simulated_car_runs_too_fast(season: str, windows: int, shared_data: Path, tmp_path: Path) -> None:
    folder = shared_data / "bmw_i3"
    if not folder.is_dir():
        pytest.skip(f"the trips are not at {folder}")
    result = validated(season, folder, tmp_path)
    ends = result.extra["validation"]["windows"]
    low, high = ends["interval95"]
    assert 0.5 < ends["mean_end_error"] < 2.5
    assert low < ends["mean_end_error"] < high
    assert ends["windows"] > windows  # of 20 s; the frozen half of one winter trip is cut
    assert "too fast" in result.sentence
    if season == "summer":  # ten trips tell it from chance, four do not
        assert low > 0.0
        assert "more than its parameters' uncertainty explains" in result.sentence
    assert len(result.parameters) == 0
