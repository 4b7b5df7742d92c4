"""A file that cannot be read is refused in one clear message with all its problems."""

from __future__ import annotations

import gzip
import os
from pathlib import Path

import numpy as np
import pytest

from tests.io.text_logs import read_csv
from vdyn_cli.io.csv import csv_source
from vdyn_cli.io.reader import Column, ReadOptions
from vdyn_cli.quantities.errors import InputError

COLUMNS = {
    "time": Column("t", "s", "s", where="run.yaml:3"),
    "speed": Column("v [m/s]", "m/s", "m/s", where="run.yaml:4"),
}
GOOD = "t,v [m/s],note\n" + "".join(f"{i / 10:.1f},{np.sin(i):.3f},ok\n" for i in range(40))


def refused(folder: Path, content: bytes | str, columns: dict[str, Column] = COLUMNS, **options: object) -> str:
    path = folder / "run.csv"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    with pytest.raises(InputError) as caught:
        read_csv(path, columns, ReadOptions(**options))  # type: ignore[arg-type]
    return str(caught.value)


def changed(line: int, text: str) -> str:
    lines = GOOD.splitlines()
    lines[line - 1] = text
    return "\n".join(lines) + "\n"


def test_a_missing_file_names_similar_ones(tmp_path: Path) -> None:
    (tmp_path / "coast_1.csv").write_text(GOOD)
    with pytest.raises(InputError, match=r"coast_l.csv: no such file\n    -> did you mean coast_1.csv\?"):
        read_csv(tmp_path / "coast_l.csv", COLUMNS)
    with pytest.raises(InputError, match="there is no folder"):
        read_csv(tmp_path / "nowhere" / "run.csv", COLUMNS)


def test_what_is_no_file_or_may_not_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="is a folder, not a log"):
        read_csv(tmp_path, COLUMNS)
    for name in ("a.log", "b.log", "coast.yaml"):
        (tmp_path / name).touch()
    with pytest.raises(InputError, match=r"name the logs in it, such as .*/a\.log"):
        read_csv(tmp_path, COLUMNS)
    with pytest.raises(InputError, match="cannot be read"):
        read_csv(tmp_path / ("x" * 5000), COLUMNS)
    with pytest.raises(InputError, match="cannot be read"):
        read_csv(tmp_path / "a\0b", COLUMNS)

    def forbidden(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "open", forbidden)
    with pytest.raises(InputError, match="or check its permissions"):
        read_csv(tmp_path / "run.csv", COLUMNS)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "the file is empty"),
        ("\ufeff\r\n", "the file is empty"),
        ("t,v [m/s]\n", "has no rows of data"),
        ("t,v [m/s]\n\n\n", "has no rows of data"),
        ("x,ID,Name\n0,a,b\n1,a,b\n", "contains no table with two columns of numbers"),
        ("t,v [m/s]\n0,1\n", "fewer than two rows of data"),
        ("t,v [m/s]\n1,1\n1,2\n1,3\n", "the time is constant"),
        ("0,1\n0.1,2\n", "has no header: the first line contains numbers"),
        ("speed\n1\n2\n", "has a single column"),
        ("\0\1\2\3" * 100, "is not a text file"),
        (bytes(range(256)) * 10, "is not a text file"),
        (b"PK\3\4" + bytes(99), "Excel workbook (.xlsx), not a text log"),
        (b"MDF     4.10    " + bytes(99), "MDF/MF4 measurement, not a text log"),
        (b"\x89HDF\r\n" + bytes(99), "HDF5"),
        (gzip.compress(GOOD.encode())[:-30], "gzip file is damaged or incomplete"),
        (gzip.compress(GOOD.encode())[:40] + b"??????" + gzip.compress(GOOD.encode())[46:], "gzip file is damaged"),
        (gzip.compress(b"", mtime=0), "the file is empty"),
    ],
)
def test_files_without_a_table(tmp_path: Path, content: bytes | str, message: str) -> None:
    assert message in refused(tmp_path, content)


def test_all_missing_columns_are_named_with_the_closest(tmp_path: Path) -> None:
    columns = {
        "time": Column("t", "s", "s", where="run.yaml:3"),
        "speed": Column("GPS-Speed [km/h]", "km/h", "m/s", where="run.yaml:4"),
        "torque": Column("Moter Torque", "Nm", "N*m", where="run.yaml:5"),
        "grade": Column("xyz", "", "", where="run.yaml:6"),
    }
    message = refused(tmp_path, "t,gps speed [m/s],Motor Torque [Nm]\n0,1,2\n1,2,3\n", columns)
    assert "run.yaml:4: channel 'speed': no such column in run.csv (got 'GPS-Speed [km/h]')" in message
    assert "did you mean 'gps speed [m/s]'?" in message
    assert "run.yaml:5" in message
    assert "did you mean 'Motor Torque [Nm]'?" in message
    assert "run.yaml:6" in message
    assert "its columns are 't', 'gps speed [m/s]', 'Motor Torque [Nm]'" in message


def test_no_column_at_all_is_still_answered_with_names(tmp_path: Path) -> None:
    message = refused(tmp_path, "Rig 7;2024\nZeit;Tempo [km/h]\ns;km/h\n0;1\n1;2\n")
    assert "run.yaml:3" in message
    assert "run.yaml:4" in message
    assert "'Zeit', 'Tempo [km/h]'" in message


def test_a_repeated_header_asks_which(tmp_path: Path) -> None:
    message = refused(tmp_path, "t,v [m/s],v [m/s]\n0,1,2\n1,2,3\n")
    assert "run.yaml:4: channel 'speed': 2 columns of this name, numbers 2, 3, in run.csv" in message
    assert "write column: 'v [m/s]#1' or 'v [m/s]#2'" in message


def test_a_misspelled_name_of_two_columns_is_answered_with_both(tmp_path: Path) -> None:
    """The remedy names columns that are accepted: the plain name would be refused again."""
    message = refused(tmp_path, "t,V [m/s],V [m/s]\n0,1,2\n1,2,3\n")
    assert "did you mean 'V [m/s]#1' or 'V [m/s]#2'?" in message


@pytest.mark.parametrize(
    ("line", "text", "message"),
    [
        (
            9,
            "0.7,ERR,ok",
            "run.csv:9: text among the numbers of channel 'speed', column 'v [m/s]': 1 cell, line 9 (got 'ERR')",
        ),
        (9, "0.7,1;2,ok", "got '1;2'"),
        (9, '0.7,"1,5",ok', "(got '1,5')\n    -> if all numbers have this format, add 'reading: {decimal: \",\"}'"),
        (9, "12:30:01,1,ok", "export the time as seconds, or times such as 10:23:11.5"),
        (9, "0.7,1,ok,more", "rows longer than the header's 3 columns (1: line 9) (got 'more')"),
        (9, "0,7,0,1,ok", "longer than the header's 3 columns"),
        (9, '0.7,1,"ok', "a quote that opens at this line is not closed"),
        (9, "0.7,0x10,ok", "got '0x10'"),
        (9, "0.7,1_000,ok", "got '1_000'"),
        (9, "0.7,\x001,ok", "text among the numbers"),
    ],
)
def test_damaged_rows_are_named_by_line(tmp_path: Path, line: int, text: str, message: str) -> None:
    assert message in refused(tmp_path, changed(line, text))


def test_a_header_before_a_clock_that_begins_anew_joins_two_files(tmp_path: Path) -> None:
    message = refused(tmp_path, "t,v [m/s],a\n0,1,2\n1,2,3\n2,3,4\nt,v [m/s],a\n0,1,2\n1,2,3\n")
    assert "the header is repeated and the clock restarts: files were joined; split them" in message


def test_lines_are_right_in_later_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened = csv_source.open_source
    monkeypatch.setattr("vdyn_cli.io.csv.csv_reader.open_source", lambda path, encoding: opened(path, encoding, 100))
    assert "run.csv:38: text among the numbers" in refused(tmp_path, changed(38, "3.6,ERR,ok"))
    assert "a quote that opens at this line is not closed" in refused(tmp_path, changed(38, '3.6,1,"ok'))
    assert "steps back in 1 row (line 33)" in refused(tmp_path, changed(33, "0.05,1,ok"))


def test_a_time_of_day_in_another_unit_than_s_is_refused(tmp_path: Path) -> None:
    content = "t;v [m/s];a\n" + "".join(f"12:30:{i:02d}.5;{i};{i}\n" for i in range(20))
    message = refused(tmp_path, content, {**COLUMNS, "time": Column("t", "ms", "s")})
    assert "column 't', which contains times of day" in message


def test_a_date_that_no_calendar_has_is_text(tmp_path: Path) -> None:
    days = [*range(1, 20), 30, 31, *range(20, 29)]
    rows = [f"2024-02-{day:02d} 12:30:00,{i},{i}\n" for i, day in enumerate(days)]
    message = refused(tmp_path, "t,v [m/s],a\n" + "".join(rows))
    assert "2 cells" in message
    assert "2024-02-30 12:30:00" in message


def test_text_in_several_columns_is_reported_together(tmp_path: Path) -> None:
    lines = GOOD.splitlines()
    for i in range(5, 30):
        lines[i] = "x,y,z"
    message = refused(tmp_path, "\n".join(lines))
    assert "channel 'time', column 't': 25 cells, line 6, 7, 8, 9, ... (got 'x')" in message
    assert "channel 'speed', column 'v [m/s]': 25 cells" in message


def test_a_column_of_text_is_refused_without_reading_on(tmp_path: Path) -> None:
    content = "t,v [m/s]\n" + "".join(f"{i},{'abc' if i else 1}\n" for i in range(5000))
    assert "at least 4999 cells" in refused(tmp_path, content)


@pytest.mark.parametrize(
    ("times", "message"),
    [
        ([0, 1, 2, 2, 3], "time repeats in 1 row (line 5)"),
        ([0, 1, 2, 1.5, 3], "time steps back in 1 row (line 5); the largest step back is from 2 s to 1.5 s at line 5"),
        ([0, 1, 2, "", 3], "time is missing in 1 row (line 5)"),
        ([0, 1, 2, "inf", 3], "time is missing in 1 row (line 5)"),
    ],
)
def test_a_clock_that_does_not_rise_is_refused_with_the_remedy(
    tmp_path: Path, times: list[object], message: str
) -> None:
    text = refused(tmp_path, "t,v [m/s]\n" + "".join(f"{t},{i}\n" for i, t in enumerate([*times, 4, 5, 6])))
    assert f"run.csv, column 't': {message}" in text
    assert "reading: {clock: drop}" in text


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ([""] * 40, "is empty"),
        (["nan"] * 40, "is empty"),
        (["1", "2", "3"] * 5 + [""] * 25, "no value in 25 of 40 rows"),
    ],
)
def test_a_channel_without_data_is_refused(tmp_path: Path, values: list[str], message: str) -> None:
    text = refused(tmp_path, "t,v [m/s]\n" + "".join(f"{i},{v}\n" for i, v in enumerate(values)))
    assert "run.csv, column 'v [m/s]': " in text
    assert message in text


@pytest.mark.parametrize("delimiter", ["", "ab", "a", '"', "\n", "é"])
def test_an_impossible_delimiter(tmp_path: Path, delimiter: str) -> None:
    assert "cannot be a delimiter" in refused(tmp_path, GOOD, delimiter=delimiter)


def test_impossible_options(tmp_path: Path) -> None:
    assert "unknown encoding" in refused(tmp_path, GOOD, encoding="utf-99")
    assert "unknown encoding" in refused(tmp_path, GOOD, encoding="base64")
    assert "line 7 is not a header with numbers below it" in refused(tmp_path, "t,v [m/s]\n0,1\n", header_row=7)
    columns = COLUMNS | {"speed": Column("v [m/s]", "kg", "m/s", where="run.yaml:4")}
    assert "run.yaml:4: 'kg' is not a unit of speed (m/s)" in refused(tmp_path, GOOD, columns)


def test_a_device_that_never_ends_is_refused() -> None:
    if not os.path.exists("/dev/zero"):
        pytest.skip("no /dev/zero here")
    with pytest.raises(InputError, match="is a device"):
        read_csv(Path("/dev/zero"), COLUMNS)
