"""Long drives that the simulation misses as a whole, over hills that no channel shows: windows are the answer."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from tests.open_road import Truth, description, drive, written
from vdyn_cli.project.execute import RefusedResultError, execute

HILLS = Truth(hills=0.03, loss=0.0)


def test_windows_answer_with_both_errors_and_what_they_leave_open(tmp_path: Path) -> None:
    result = execute("validate", whole_drives(tmp_path, 200.0), level=None).result
    found = result.extra["validation"]
    whole = found["whole_drives"]["rms"]
    assert whole > 3.0 * abs(found["windows"]["mean_end_error"])
    assert result.sentence.startswith("After 20 s the simulated car is ")
    assert f"over the whole drives the simulated speed is off by {3.6 * whole:.1f} km/h rms" in result.sentence
    (warning,) = [w for w in result.fit.warnings if "no result for the whole drive" in w]
    assert "drive_0.csv, channel 'drive_torque'" in warning
    assert "% rms of the largest speed" in warning


def test_a_short_drive_has_no_windows_to_answer_with(tmp_path: Path) -> None:
    with pytest.raises(RefusedResultError, match="does not produce this speed"):
        execute("validate", whole_drives(tmp_path, 80.0), level=None)


def test_windows_do_not_hide_a_torque_of_another_drive(tmp_path: Path) -> None:
    path = whole_drives(tmp_path, 200.0)
    rows = [line.split(";") for line in (tmp_path / "drive_0.csv").read_text(encoding="utf-8").splitlines()]
    later = rows[801:] + rows[1:801]
    mixed = [";".join((*row[:2], other[2], row[3])) for row, other in zip(rows[1:], later, strict=True)]
    (tmp_path / "drive_0.csv").write_text("\n".join([";".join(rows[0]), *mixed]) + "\n", encoding="utf-8")
    with pytest.raises(RefusedResultError, match="one drive and one clock"):
        execute("validate", path, level=None)


def whole_drives(folder: Path, seconds: float) -> Path:
    """A drive over hills whose description maps neither accelerometer nor elevation, and states no windows."""
    described = dict(description(folder, [drive(HILLS, 5, seconds)]), settings={"model": "road_load"})
    del described["channels"]["acceleration"]
    path = written(folder, described)
    assert "windows" not in yaml.safe_load(path.read_text(encoding="utf-8"))["settings"]
    return path
