"""Tables that begin with numbers: their columns are called by number."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vdyn_cli.io.channel_survey import survey
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.reader import Column
from vdyn_cli.quantities.errors import InputError

TIME = np.arange(0.0, 30.0, 0.5)
SPEED = 27.3 - 0.11 * TIME
COLUMNS = {"time": Column("column 1", "s", "s"), "speed": Column("column 2", "km/h", "m/s")}


def rows(form: str, end: str = "") -> str:
    return "".join(form.format(t, v) + "\n" for t, v in zip(TIME, SPEED, strict=True)) + end


@pytest.mark.parametrize(
    "text",
    [
        rows("{:.2f},{:.4f}"), rows("{:.2f}\t{:.4f}"), rows("{:.2f},{:.4f}", ",\n" * 40),
        rows("{:.2f};{:.4f}").replace(".", ","), rows("{:.2f},{:.4f},imu_frame"), "\n" + rows("{:.2f},{:.4f}"),
    ],
    ids=["commas", "tabs", "empty rows at the end", "decimal commas", "a column of text", "an empty first line"],
)  # fmt: skip
def test_columns_are_read_by_their_numbers(text: str, tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text(text)
    facts = survey(path)
    assert [f.column for f in facts][:2] == ["column 1", "column 2"]
    assert [f.state for f in facts][:2] == ["clock", "varies"]
    log = read_log(path, COLUMNS)
    assert log.time == pytest.approx(TIME)
    assert log["speed"] == pytest.approx(SPEED / 3.6, abs=1e-4)


def test_the_message_on_columns_by_name_states_their_numbers(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text(rows("{:.2f},{:.4f}"))
    with pytest.raises(InputError, match="has no header") as error:
        read_log(path, {"time": Column("t", "s", "s"), "speed": Column("v", "km/h", "m/s")})
    assert "write 'column 1' to 'column 2'" in error.value.findings[0].remedy


def test_a_first_row_of_numbers_above_a_header_is_no_table(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("2026,1\nTime,Speed\n" + rows("{:.2f},{:.4f}"))
    assert [f.column for f in survey(path)] == ["Time", "Speed"]
