"""Files with several recordings, whose clock restarts with each: listed, drafted as runs, and read by number."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.io.stored_logs import Array, write
from vdyn_cli.commands.run_channels import channels_table
from vdyn_cli.io.csv.csv_reader import CSV
from vdyn_cli.io.reader import Column, ReadOptions
from vdyn_cli.project.drafting.description_draft import draft_description
from vdyn_cli.project.inputs import Inputs, gather
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.steps import load_step

STEP = load_step("coastdown")
TIME = np.arange(900) / 10.0
SPEEDS = [  # m/s, of each recording
    30.0 + k - 0.2 * TIME + np.random.default_rng(k).normal(0.0, 0.02, TIME.size) for k in range(3)
]
VALUES = {
    "mass": "1500 kg",
    "rotating_mass": "60 kg",
    "frontal_area": "2 m^2",
    "temperature": "24 degC",
    "pressure": "98.9 kPa",
}


def joined(folder: Path, kind: str) -> Path:
    """The three recordings in one file; ``headers``: each with its header."""
    columns: dict[str, Array] = {"time": np.tile(TIME, 3), "speed": np.concatenate(SPEEDS)}
    if kind in ("parquet", "mat", "mf4"):
        return write(kind, folder / "joined", [columns], {"time": "s", "speed": "m/s"})
    rows = [f"{t:.1f},{v:.6f}" for t, v in zip(*columns.values(), strict=True)]
    header = "time [s],speed [m/s]"
    parts = [rows[900 * k : 900 * (k + 1)] for k in range(3)]
    between = [header] if kind == "headers" else []
    path = folder / "joined.csv"
    path.write_text("\n".join([header, *parts[0], *between, *parts[1], *between, *parts[2]]) + "\n")
    return path


def described(path: Path, change: tuple[str, str] = ("", "")) -> Inputs:
    """The inputs of the drafted description, with values for what the log doesn't contain."""
    text = draft_description(STEP, [path], path.parent).text
    for key, value in VALUES.items():
        text = re.sub(rf'\b{key}: "\?"', f"{key}: {value}", text)
    text = text.replace('unit: "?"', "unit: m/s")
    description = path.with_suffix(".yaml")
    description.write_text(text.replace(*change) if change[0] else text)
    return gather(STEP, description)


@pytest.mark.parametrize("kind", ["csv", "headers", "parquet", "mat", "mf4"])
def test_each_recording_of_a_file_is_drafted_as_a_run_and_read(kind: str, tmp_path: Path) -> None:
    path = joined(tmp_path, kind)
    assert "restarts: the file has 3 recordings (1: 0.00 s to 89.90 s, 2: 0.00 s" in channels_table(path)[0]
    logs = described(path).logs
    assert [log.name for log in logs] == [f"{path.name} (recording {k})" for k in (1, 2, 3)]
    for log, speed in zip(logs, SPEEDS, strict=True):
        assert log.time == pytest.approx(TIME)
        assert log["speed"] == pytest.approx(speed, abs=1e-6)


@pytest.mark.parametrize(
    ("kind", "change", "message"),
    [
        ("csv", (", recording: 2}", "}"), "list it as one run for each, with 'recording: 1' to 'recording: 3'"),
        (
            "headers",
            (", recording: 2}", "}"),
            "as one run for each, with 'recording: 1' to",
        ),
        ("mat", (", recording: 2}", "}"), "list it as one run for each, with 'recording: 1' to 'recording: 3'"),
        ("csv", ("recording: 3", "recording: 4"), "has 3 recordings: its clock restarts 2 times"),
        ("csv", ("recording: 3", "recording: 2"), "list each recording once"),
    ],
)
def test_a_wrong_number_of_the_recording_is_refused(
    kind: str, change: tuple[str, str], message: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError) as refused:
        described(joined(tmp_path, kind), change)
    assert message in str(refused.value)


@pytest.mark.parametrize(("kind", "line"), [("csv", 902), ("headers", 903)])
def test_messages_name_the_lines_of_the_file(kind: str, line: int, tmp_path: Path) -> None:
    time = {"time": Column("time [s]", "s", "s")}
    assert CSV.read(joined(tmp_path, kind), time, ReadOptions(recording=2), "joined.csv").line(0) == line
