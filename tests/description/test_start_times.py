"""Starts of runs as times of day become seconds after the first run."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.yaml_source import load_yaml


def starts(*written: object) -> list[float]:
    runs = [{"log": f"{k}.csv", "start": start} for k, start in enumerate(written)]
    return [r.start.value for r in Description.model_validate({"test": "coastdown", "runs": runs}).runs if r.start]


def test_times_of_day_count_from_the_first_run() -> None:
    assert starts("10:08:14", "10:11:23.5", "9:58") == [0.0, 189.5, -614.0]


def test_a_day_may_end_between_two_runs() -> None:
    assert starts("23:59", "00:02") == [0.0, 180.0]


def test_seconds_are_read_as_before() -> None:
    assert starts("0 s", 189, "5 min") == [0.0, 189.0, 300.0]


def test_both_ways_in_one_description_are_refused() -> None:
    with pytest.raises(ValidationError, match="'start' is a time of day in 1 of 2 runs"):
        starts("10:08", "189 s")


def test_yaml_keeps_a_time_of_day_as_text(tmp_path: Path) -> None:
    path = tmp_path / "test.yaml"
    path.write_text("runs: [{start: 10:08}, {start: 10:08:14.5}, {start: 14}]", encoding="utf-8")
    assert [run["start"] for run in load_yaml(path).data["runs"]] == ["10:08", "10:08:14.5", 14]
