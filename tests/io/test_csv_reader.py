"""All variants in which test benches write CSV give the same log."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import numpy as np
import pytest

from tests.io.text_logs import read_csv
from vdyn_cli.io.csv import csv_source
from vdyn_cli.io.csv.csv_reader import CSV
from vdyn_cli.io.reader import Column, ReadOptions
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log

N = 50
TIME = np.arange(N) * 0.01
SPEED = 50.0 + np.round(5.0 * np.sin(TIME * 7.0), 3)
TORQUE = np.round(np.cos(np.arange(N) * 2.3), 4)
NAMES = ("Time [s]", "Speed, GPS [km/h]", "Torque [Nm]")
COLUMNS = {
    "time": Column("Time [s]", "s", "s"),
    "speed": Column("Speed, GPS [km/h]", "km/h", "m/s"),
    "torque": Column("Torque [Nm]", "Nm", "N*m", sign=-1),
}


def table(delimiter: str = ",", decimal: str = ".", newline: str = "\n", names: tuple[str, ...] = NAMES) -> str:
    header = delimiter.join(f'"{n}"' for n in names)
    table = zip(TIME, SPEED, TORQUE, strict=True)
    rows = [delimiter.join(f"{x:.4f}".replace(".", decimal) for x in row) for row in table]
    return newline.join([header, *rows]) + newline


def read(folder: Path, content: bytes | str, columns: dict[str, Column] = COLUMNS, **options: object) -> Log:
    path = folder / "run.csv"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return read_csv(path, columns, ReadOptions(**options))  # type: ignore[arg-type]


def largest_error(log: Log) -> float:
    """The largest relative error of time, speed and torque; infinite where rows are missing."""
    pairs = (log.time, TIME), (log["speed"], SPEED / 3.6), (log["torque"], -TORQUE)
    if any(read.shape != true.shape for read, true in pairs):
        return float("inf")
    return max(float(np.max(np.abs(read - true) / np.maximum(np.abs(true), 1.0))) for read, true in pairs)


def said(log: Log) -> str:
    return "\n".join(str(f) for f in log.findings)


@pytest.mark.parametrize(
    ("delimiter", "decimal"), [(d, m) for d in (",", ";", "\t", "|", " ", "  ") for m in (".", ",") if d != m]
)
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_delimiters_decimal_marks_and_line_ends_are_recognised(
    tmp_path: Path, delimiter: str, decimal: str, newline: str
) -> None:
    log = read(tmp_path, table(delimiter, decimal, newline))
    assert largest_error(log) < 1e-12
    assert log.findings == ()
    assert log.name == "run.csv"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "cp1252", "utf-16", "utf-16-le", "utf-16-be"])
def test_encodings_are_recognised(tmp_path: Path, encoding: str) -> None:
    names = ("Time [s]", "Öltemperatur [°C]", "Torque [Nm]")
    columns = {"time": COLUMNS["time"], "temperature": Column("Öltemperatur [°C]", "degC", "K")}
    log = read(tmp_path, table(";", names=names).encode(encoding), columns)
    np.testing.assert_allclose(log["temperature"], SPEED + 273.15)
    assert log.findings == ()


def test_an_encoding_can_be_given(tmp_path: Path) -> None:
    names = ("Time [s]", "速度", "Torque [Nm]")
    columns = {"time": COLUMNS["time"], "speed": Column("速度", "km/h", "m/s")}
    log = read(tmp_path, table(";", names=names).encode("shift_jis"), columns, encoding="shift_jis")
    np.testing.assert_allclose(log["speed"], SPEED / 3.6)


def test_gzip_is_recognised_by_its_content(tmp_path: Path) -> None:
    assert largest_error(read(tmp_path, gzip.compress(table().encode()))) < 1e-12


def test_quoted_decimal_commas_in_a_comma_separated_file(tmp_path: Path) -> None:
    header, *lines = table("|", ",").splitlines()
    quoted = ['"' + line.replace("|", '","') + '"' for line in lines]
    assert largest_error(read(tmp_path, "\n".join([header.replace("|", ","), *quoted]))) < 1e-12


def test_whole_numbers_at_first_and_decimal_commas_later(tmp_path: Path) -> None:
    lines = ["t;v"] + [f"{i};{i}" for i in range(20_000)] + ["20000,5;3,25"]
    log = read(tmp_path, "\n".join(lines), {"time": Column("t", "s", "s"), "v": Column("v", "m/s", "m/s")})
    assert log.time[-1] == 20000.5
    assert log["v"][-1] == 3.25


@pytest.mark.parametrize(("mark", "separator"), [(",", "."), (".", ",")])
def test_thousands_separators_are_removed_and_said(tmp_path: Path, mark: str, separator: str) -> None:
    swap = str.maketrans({".": mark, ",": separator})
    lines = ["t;v"] + [f"{i};{900 + i * 5.5:,.1f}".translate(swap) for i in range(50)]
    log = read(tmp_path, "\n".join(lines), {"time": Column("t", "s", "s"), "v": Column("v", "m", "m")})
    np.testing.assert_allclose(log["v"], 900 + np.arange(50) * 5.5)
    assert "thousands separators removed from 31 numbers" in said(log)


def test_whole_numbers_with_thousands_separators_are_read_where_other_numbers_show_the_mark(tmp_path: Path) -> None:
    lines = ["t,v"] + [f'"{100 * i:,}",{i / 4}' for i in range(50)]
    log = read(tmp_path, "\n".join(lines), {"time": Column("t", "ms", "s"), "v": Column("v", "m", "m")})
    np.testing.assert_allclose(log.time, 0.1 * np.arange(50))
    lines = ["t,v,not mapped"] + [f'"{100 * i:,}",{i},0.5' for i in range(50)]
    log = read(tmp_path, "\n".join(lines), {"time": Column("t", "ms", "s"), "v": Column("v", "m", "m")})
    np.testing.assert_allclose(log.time, 0.1 * np.arange(50))
    lines = ["t,v"] + [f'{100 * i},"{990 + 7 * i:,}"' for i in range(90)]  # 1.004 or 1004
    with pytest.raises(InputError, match="without thousands separators; if the comma"):
        read(tmp_path, "\n".join(lines), {"time": Column("t", "ms", "s"), "v": Column("v", "m", "m")})


def test_a_units_row_is_read_and_agrees(tmp_path: Path) -> None:
    header, rest = table().split("\n", 1)
    log = read(tmp_path, f"{header}\ns,km/h,Nm\n{rest}")
    assert largest_error(log) < 1e-12
    assert log.findings == ()


def test_units_that_contradict_the_description_are_named(tmp_path: Path) -> None:
    header, rest = table().split("\n", 1)
    log = read(tmp_path, f"{header}\n[s],[mph],[Nm]\n{rest}")
    assert "units row: channel 'speed' is read in 'km/h'" in said(log)
    assert "'mph'" in said(log)
    columns = COLUMNS | {"speed": Column("Speed, GPS [km/h]", "m/s", "m/s", where="coast.yaml:7")}
    log = read(tmp_path, table(), columns)
    assert (
        "channel 'speed' is read in 'm/s' as the description says (coast.yaml:7), but the file states another unit"
        in said(log)
    )
    assert "'km/h'" in said(log)


@pytest.mark.parametrize(
    ("header", "unit", "stated"),
    [
        ("spd_mph", "km/h", "'mph'"),
        ("Speed kmh", "mph", "'km/h'"),
        ("spd_mph", "mph", ""),
        ("spd_m", "km/h", ""),
        ("speed_nm", "km/h", ""),  # another dimension
        ("v_mph (km/h)", "km/h", ""),  # brackets are more certain
    ],
)
def test_a_unit_at_the_end_of_a_name_that_contradicts_the_description_is_named(
    header: str, unit: str, stated: str, tmp_path: Path
) -> None:
    columns = COLUMNS | {"speed": Column(header, unit, "m/s")}
    log = read(tmp_path, table(names=("Time [s]", header, "Torque [Nm]")), columns)
    found = [f for f in log.findings if "states another unit" in f.what]
    assert [f.doubt for f in found] == ([True] if stated else [])
    assert stated in said(log)


@pytest.mark.parametrize(
    ("header", "unit", "stated"),
    [
        ("p_Brems [bar]", "48 N m", ""),  # the gain of a reading
        ("p_Brems [bar]", "N m", "'0.5 N m' for 0.5 N m in 1 bar"),
        ("M [kN m]", "48 N m", "'kN m'"),
        ("M_mV", "0.4 N m", ""),
        ("M_daNm", "N m", "'daN m'"),
    ],
)
def test_a_gain_converts_a_reading_of_another_dimension(header: str, unit: str, stated: str, tmp_path: Path) -> None:
    columns = COLUMNS | {"torque": Column(header, unit, "N m")}
    log = read(tmp_path, table(names=(*NAMES[:2], header)), columns)
    assert bool(log.findings) == bool(stated)
    assert stated in said(log)


@pytest.mark.parametrize(("unit", "told"), [("m/s^2", True), ("g", False)])
def test_a_g_at_the_end_of_the_name_of_an_acceleration_is_its_unit(unit: str, told: bool, tmp_path: Path) -> None:
    columns = {"time": COLUMNS["time"], "acceleration": Column("AccX_g", unit, "m/s^2")}
    log = read(tmp_path, table(names=("Time [s]", "AccX_g", "Torque [Nm]")), columns)
    assert ["another unit 'g'" in f.what for f in log.findings] == [True] * told


@pytest.mark.parametrize("header", ["Speed (GPS)", "Speed (L)", "Speed [raw]", "Speed (front)", "Speed [km/h)"])
def test_brackets_that_hold_no_contradicting_unit_are_no_finding(tmp_path: Path, header: str) -> None:
    columns = COLUMNS | {"speed": Column(header, "km/h", "m/s")}
    assert read(tmp_path, table(names=("Time [s]", header, "Torque [Nm]")), columns).findings == ()


def test_lines_before_the_header_are_passed_over(tmp_path: Path) -> None:
    head = 'Bench 7;Version 2,1\nDriver: "unknown" 5" wheels\nDate;12.05.2024 10:00\nSpeed, GPS [km/h];is mapped\n\n'
    assert largest_error(read(tmp_path, head + table(";"))) < 1e-12


def test_a_long_preamble_and_a_given_header_row(tmp_path: Path) -> None:
    preamble = "".join(f"channel {i};rate 100 Hz;range {i}\n" for i in range(300))
    assert largest_error(read(tmp_path, preamble + table(";"))) < 1e-12
    assert largest_error(read(tmp_path, preamble + table(";"), header_row=301, delimiter=";", decimal=".")) < 1e-12


def test_a_header_written_as_a_comment(tmp_path: Path) -> None:
    lines = ["# t v"] + [f"{i * 0.1:.1f} {i}" for i in range(30)]
    log = read(tmp_path, "\n".join(lines), {"time": Column("t", "s", "s"), "v": Column("v", "m", "m")})
    assert log.time.size == 30


def test_a_quoted_header_may_run_over_a_line_end(tmp_path: Path) -> None:
    content = table(";").replace('"Torque [Nm]"', '"Torque\r\n[Nm]"')
    log = read(tmp_path, content)
    assert largest_error(log) < 1e-12


def test_rows_between_header_and_numbers_are_skipped_aloud(tmp_path: Path) -> None:
    header, rest = table(";").split("\n", 1)
    log = read(tmp_path, f"{header}\ns;km/h;Nm\nclock;CAN 1;rig\n{rest}")
    assert largest_error(log) < 1e-12
    assert "run.csv:3: row between header and numbers skipped (got 'clock;CAN 1;rig')" in said(log)


@pytest.mark.parametrize("below", ["\nMean;50,1;0,2\nMax;55;1\n", "Mean: 50.1\n", ";;\n\n;50.1;0.2\n"])
def test_a_summary_below_the_data_is_left_out_aloud(tmp_path: Path, below: str) -> None:
    log = read(tmp_path, table(";") + below)
    assert largest_error(log) < 1e-12
    assert re.search(r"left out: rows below the data \(\d: line 5", said(log))


def test_blank_lines_and_an_end_mark_at_the_end_are_nothing_to_say(tmp_path: Path) -> None:
    for end in ("\n\n", "\x1a", "\r\n\x1a"):
        log = read(tmp_path, table() + end)
        assert largest_error(log) < 1e-12
        assert log.findings == ()


def test_blank_lines_between_rows_are_left_out_aloud(tmp_path: Path) -> None:
    lines = table().splitlines()
    log = read(tmp_path, "\n".join([*lines[:10], "", ",,", *lines[10:]]))
    assert largest_error(log) < 1e-12
    assert "left out: rows without any mapped value (2: line 11, 12)" in said(log)


def test_a_last_line_that_is_cut_off_is_left_out_aloud(tmp_path: Path) -> None:
    log = read(tmp_path, table() + "0.5000,4")
    assert largest_error(log) < 1e-12
    assert "run.csv:52: the last line is incomplete and ignored" in said(log)


def test_a_last_number_that_is_cut_off_is_left_out_aloud(tmp_path: Path) -> None:
    """Also with the zero bytes of a file whose logger lost power; a whole row needs no line end."""
    assert read(tmp_path, table().rstrip()).findings == ()
    log = read(tmp_path, table() + "0.5000,40.1234,1.0" + 5000 * "\0")
    assert largest_error(log) < 1e-12
    assert "run.csv:52: the last line is incomplete and ignored" in said(log)


@pytest.mark.parametrize("above", ["# t v x\n# s km/h N m\n", "# run 7\n# columns: t[s] v[km/h] x\n", "#  t   v  x\n"])
def test_a_header_written_as_a_comment_names_the_columns_below_it(above: str, tmp_path: Path) -> None:
    rows = "".join(f"{t:.4f} {v:.4f} {x:.4f}\n" for t, v, x in zip(TIME, SPEED, TORQUE, strict=True))
    at = "[s]" if "[s]" in above else ""
    of = "[km/h]" if at else ""
    columns = {"time": Column("t" + at, "s", "s"), "speed": Column("v" + of, "km/h", "m/s")}
    log = read(tmp_path, above + rows, columns)
    np.testing.assert_allclose(log.time, TIME, atol=1e-9)
    np.testing.assert_allclose(log["speed"], SPEED / 3.6, atol=1e-4)


def test_missing_values_are_nan_and_said(tmp_path: Path) -> None:
    lines = table().splitlines()
    for row, word in ((5, ""), (6, "NaN"), (9, "-")):
        cells = lines[row].split(",")
        lines[row] = ",".join([cells[0], word, cells[2]])
    log = read(tmp_path, "\n".join(lines))
    assert np.flatnonzero(np.isnan(log["speed"])).tolist() == [4, 5, 8]
    assert "has no value in 3 of 50 rows" in said(log)
    assert "longest: lines 6 to 7" in said(log)


def test_switches_written_as_words(tmp_path: Path) -> None:
    lines = ["t,brake"] + [f"{i},{'TRUE' if i > 5 else 'false'}" for i in range(10)]
    log = read(tmp_path, "\n".join(lines), {"time": Column("t", "s", "s"), "brake": Column("brake", "", "")})
    assert log["brake"].tolist() == [0.0] * 6 + [1.0] * 4


def test_an_optional_column_may_be_missing_or_empty(tmp_path: Path) -> None:
    lines = ["t,v,e"] + [f"{i},{i}," for i in range(10)]
    columns = {
        "time": Column("t", "s", "s"),
        "v": Column("v", "m", "m"),
        "grade": Column("grade", "", "", optional=True),
        "empty": Column("e", "m", "m", optional=True),
    }
    log = read(tmp_path, "\n".join(lines), columns)
    assert sorted(log.channels) == ["v"]
    assert "channel 'grade' is left out" in said(log)
    assert "channel 'empty' is left out" in said(log)


def test_repeated_headers_are_distinguished_by_number(tmp_path: Path) -> None:
    content = "t,v,v\n" + "".join(f"{i},{i},{-i}\n" for i in range(5))
    columns = {"time": Column("t", "s", "s"), "second": Column("v#2", "m", "m")}
    assert read(tmp_path, content, columns)["second"].tolist() == [0.0, -1.0, -2.0, -3.0, -4.0]


def test_blocks_are_joined_without_a_seam(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened = csv_source.open_source
    monkeypatch.setattr("vdyn_cli.io.csv.csv_reader.open_source", lambda path, encoding: opened(path, encoding, 700))
    assert largest_error(read(tmp_path, table(newline="\r\n"))) < 1e-12
    assert largest_error(read(tmp_path, table(";").encode("utf-16"))) < 1e-12


def test_real_trips_of_an_electric_car(shared_data: Path) -> None:
    columns = {
        "time": Column("Time [s]", "s", "s"),
        "speed": Column("Velocity [km/h]", "km/h", "m/s"),
        "torque": Column("Motor Torque [Nm]", "Nm", "N*m"),
        "charge": Column("max. SoC [%)", "%", "", optional=True),
        "outside": Column("Ambient Temperature [°C]", "degC", "K"),
    }
    paths = sorted((shared_data / "bmw_i3").glob("*.csv.gz"))
    assert paths
    for path in paths:
        log = read_csv(path, columns)
        assert np.median(np.diff(log.time)) == pytest.approx(0.1)
        assert 10.0 < log["speed"].max() < 45.0
        assert 270.0 < log["outside"].min() < 310.0
        # A road log of good sensors: the only findings may be on values that the logger left out.
        assert all("has no value" in f.what or "left out" in f.remedy for f in log.findings)


def test_real_recordings_of_four_clocks(shared_data: Path) -> None:
    log = read_csv(
        shared_data / "comma2k19_segment" / "wheel_speed_mps.csv",
        {"time": Column("t", "s", "s"), "front_left": Column("fl", "m/s", "m/s")},
    )
    assert "uneven clock" in said(log)
    log = read_csv(
        shared_data / "pendulum_bicycle" / "bicycle-wheel-axial-inertia-rate-gyro-measurement.csv",
        {"time": Column("time", "s", "s"), "rate": Column("angular_velocity", "rad/s", "rad/s")},
    )
    assert log.findings == ()
    assert log.time.size == 2317


@pytest.mark.parametrize("text", ["s;km/h\nZeit;Tempo\n", "Zeit;Tempo\ns;km/h\n"])
def test_a_units_row_above_or_below_is_not_the_header(text: str, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(text + "".join(f"{0.1 * k:.1f};{k}\n" for k in range(30)))
    assert [(c.name, c.unit) for c in CSV.channels(tmp_path / "log.csv")] == [("Zeit", "s"), ("Tempo", "km/h")]
