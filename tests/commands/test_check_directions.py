"""Directions and start times that the logs contradict are corrected before runs are judged."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.commands.test_check import RUNS, campaign, checked
from vdyn_cli.commands.run_step import write_step
from vdyn_cli.quantities.errors import ResultError


@pytest.mark.slow
def test_a_direction_that_the_position_contradicts_is_corrected_before_runs_are_judged(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda run, time, speed: speed)
    for k in range(RUNS):
        head, *rows = (tmp_path / f"coast_{k}.csv").read_text().splitlines()
        speed = np.array([float(row.split(",")[1]) / 3.6 for row in rows])
        place = (1.0 if k % 2 == 0 else -1.0) * 0.1 * np.cumsum(speed)
        lines = [f"{row},{x:.2f}" for row, x in zip(rows, place, strict=True)]
        (tmp_path / f"coast_{k}.csv").write_text("\n".join([head + ",dist", *lines]))
    text = path.read_text().replace("channels:\n", "channels:\n  position: {column: dist, unit: m}\n")
    path.write_text(text.replace("coast_0.csv, direction: out", "coast_0.csv, direction: back"))
    document = checked(path, tmp_path / "out", 1)
    said = "Correct the description first: coast_0.csv: position rises, but the direction is 'back'"
    assert document["sentence"].startswith(said)
    assert [r["verdict"] for r in document["runs"]] == ["wrong", *["unknown"] * (RUNS - 1)]


@pytest.mark.slow
def test_a_direction_that_the_names_of_the_logs_contradict_is_corrected_first(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda run, time, speed: speed)
    text = path.read_text()
    for k in range(RUNS):
        name = f"coast_{k}_{'hin' if k % 2 == 0 else 'her'}.csv"
        (tmp_path / f"coast_{k}.csv").rename(tmp_path / name)
        text = text.replace(f"coast_{k}.csv", name)
    path.write_text(text.replace("coast_2_hin.csv, direction: out", "coast_2_hin.csv, direction: back"))
    document = checked(path, tmp_path / "out", 1)
    said = "the log coast_2_hin.csv shows the opposite direction (by the name of the log) to most runs with 'back'"
    assert f"{said}; write 'direction: out'" in document["sentence"]


@pytest.mark.slow
def test_directions_and_starts_that_the_logs_contradict_are_corrected_before_runs_are_judged(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda run, time, speed: speed)
    for k in range(RUNS):
        head, *rows = (tmp_path / f"coast_{k}.csv").read_text().splitlines()
        lines = [f"{120 * k + float(t):.1f},{v},{180 * (k % 2) + 30}" for t, v in (row.split(",") for row in rows)]
        (tmp_path / f"coast_{k}.csv").write_text("\n".join([f"{head},Heading [deg]", *lines]))
    checked(path, tmp_path / "out", 0)
    text = path.read_text().replace("coast_2.csv, direction: out", "coast_2.csv, direction: back")
    path.write_text(text.replace("start: 480 s", "start: 360 s"))
    assert "two runs cannot start together (got 360 s)" in checked(path, tmp_path / "out", 1)["sentence"]
    text = text.replace("start: 480 s", "start: X").replace("start: 600 s", "start: 480 s")
    path.write_text(text.replace("start: X", "start: 600 s"))
    document = checked(path, tmp_path / "out", 1)
    corrections = [(f["where"], f["remedy"]) for f in document["findings"] if "write '" in f["remedy"]]
    assert corrections == [
        ("coast.yaml:11", "write 'direction: out'"),
        ("coast.yaml:13", "write 'start: 480 s', or remove 'start' from all runs"),
        ("coast.yaml:14", "write 'start: 600 s', or remove 'start' from all runs"),
    ]
    assert all(place in document["sentence"] for place, _ in corrections)
    assert [r["verdict"] for r in document["runs"]].count("unknown") == RUNS - 3
    path.write_text(text.replace("start: X", "start: 600 s"))
    with pytest.raises(ResultError):  # the cars of these logs have no drag
        write_step("coastdown", path, (), tmp_path / "out", None)
    written = json.loads((tmp_path / "out" / "coastdown.json").read_text())
    assert "shows the opposite direction" in written["fit"]["warnings"][0]
    campaign(tmp_path, lambda run, time, speed: speed)  # without a clock of the day
    path.write_text(path.read_text().replace("start: 480 s", "start: 365 s"))
    said = [f["what"] for f in checked(path, tmp_path / "out", 1)["findings"] if "'start'" in f["what"]]
    assert said == ["'start' is 90 s before the end of coast_3.csv, which lasts 95 s"]
