"""Exports of test drivers' loggers: the same coast-down in each of their text formats."""

from __future__ import annotations

import json
from datetime import UTC
from pathlib import Path

import numpy as np
import pytest

from tests.io.logger_texts import (
    BARRED,
    DATED,
    EXPORTS,
    INDEX,
    LONG,
    MESSAGES,
    MIDNIGHT,
    SPEED,
    STATION,
    TIME,
    VBO,
    rows,
)
from vdyn_cli.io.channel_survey import survey, without_clock
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.reader import Column
from vdyn_cli.quantities.errors import InputError


@pytest.mark.parametrize("name", EXPORTS)
def test_an_export_gives_the_coast(tmp_path: Path, name: str) -> None:
    content, clock, speed, unit = EXPORTS[name]
    path = tmp_path / name
    path.write_text(content, encoding="utf-8", newline="")
    log = read_log(path, {"time": Column(clock, "s", "s"), "speed": Column(speed, unit, "m/s")})
    assert log.time == pytest.approx(TIME, abs=1e-4)
    assert log["speed"] == pytest.approx(SPEED / 3.6, abs=1e-6)


def test_a_unit_behind_the_numbers_is_compared_and_another_one_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,v\n0,36 km/h\n1,35 km/h\n2,\n3,NODATA\n4,34.5 km/h\n", encoding="utf-8")
    columns = {"time": Column("t", "s", "s"), "speed": Column("v", "mph", "m/s")}
    said = [str(f) for f in read_log(path, columns).findings]
    assert any("column 'v', unit after its numbers: channel 'speed' is read in 'mph'" in one for one in said)
    path.write_text("t,v\n0,36 km/h\n1,35 km/h\n2,21 mph\n3,33 km/h\n4,32 km/h\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"log.csv:4: text among the numbers of channel 'speed'.*got '21 mph'"):
        read_log(path, columns | {"speed": Column("v", "km/h", "m/s")})


@pytest.mark.parametrize(
    ("encoding", "names"),
    [
        ("gb18030", ("时间(s)", "车速(km/h)")),
        ("shift_jis", ("時間[s]", "車速[km/h]")),
        ("euc_kr", ("시간(s)", "차속(km/h)")),
        ("cp1251", ("Время, [с]", "Скорость, [km/h]")),
        ("cp1252", ("Zeit für Läufe [s]", "Geschwindigkeit über Grund [km/h]")),
    ],
)
def test_the_encoding_of_a_header_is_known_by_its_words(tmp_path: Path, encoding: str, names: tuple[str, str]) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes((";".join(names) + "\n" + rows("{t:.2f};{v:.2f}")).encode(encoding))
    assert tuple(f.column for f in survey(path)) == names
    columns = {"time": Column(names[0], "s", "s"), "speed": Column(names[1], "km/h", "m/s")}
    assert read_log(path, columns)["speed"] == pytest.approx(SPEED / 3.6)


def test_times_of_another_language_are_refused_with_the_forms_that_are_read(tmp_path: Path) -> None:
    path = tmp_path / "months.csv"
    text = DATED.replace("-May-", "-touko-")
    path.write_text("\n".join(f"{'x' if k else 'Represented Make'},{row}" for k, row in enumerate(text.splitlines())))
    what, remedy = without_clock(survey(path))
    assert what == "no column increases like a clock"
    assert remedy.startswith("if the text of 'Device Time' is the time, export it as seconds, or times such as")
    with pytest.raises(InputError, match=r"export the time as seconds, or times such as .* months in English"):
        read_log(path, {"time": Column("Device Time", "s", "s"), "v": Column("Speed (OBD)(km/h)", "km/h", "m/s")})


def test_times_of_a_file_without_a_header_are_named(tmp_path: Path) -> None:
    path = tmp_path / "bare.csv"
    path.write_text("".join(f"@Wed May  2 10:24:{k} 2018,1,{20 - k % 7},3\n" for k in range(10, 50)))
    assert without_clock(survey(path))[1].startswith("if the text of 'column 1' is the time, export it")


@pytest.mark.parametrize("month", ["Mai", "mai", "mayo", "maggio", "maio"])
def test_months_of_several_languages_are_read(tmp_path: Path, month: str) -> None:
    path = tmp_path / "months.csv"
    path.write_text(DATED.replace("-May-", f"-{month}-"), encoding="utf-8")
    log = read_log(path, {"time": Column("Device Time", "s", "s"), "v": Column("Speed (OBD)(km/h)", "km/h", "m/s")})
    assert log.time == pytest.approx(TIME, abs=1e-4)
    assert log.begin == pytest.approx(MIDNIGHT.replace(tzinfo=UTC).timestamp())


def test_columns_of_text_hide_no_numbers(tmp_path: Path) -> None:
    """One bus message a row, with its identifier and name: no more than half of a row's cells are numbers."""
    path = tmp_path / "messages.csv"
    path.write_text(MESSAGES, encoding="utf-8")
    assert {f.column: f.state for f in survey(path)} == {
        "Time[s]": "clock", "ID": "text", "Name": "text", "VehicleSpeed[km/h]": "varies", "EngineSpeed[rpm]": "constant"
    }  # fmt: skip
    log = read_log(path, {"time": Column("Time[s]", "s", "s"), "speed": Column("VehicleSpeed[km/h]", "km/h", "m/s")})
    assert log["speed"][np.isfinite(log["speed"])] == pytest.approx(SPEED / 3.6, abs=1e-6)


def test_units_stand_with_the_names_in_the_cells_of_a_header(tmp_path: Path) -> None:
    path = tmp_path / "barred.log"
    path.write_text(BARRED, encoding="utf-8")
    assert {f.column: (f.info.unit, f.state) for f in survey(path)} == {
        "Interval": ("ms", "clock"), "Speed": ("km/h", "varies"), "GPSSats": ("", "constant")
    }  # fmt: skip
    (clock,) = [f for f in survey(path) if f.state == "clock"]
    assert (clock.lowest, clock.info.span[0]) == pytest.approx((4000.0, 4.0))
    log = read_log(path, {"time": Column("Interval", "ms", "s"), "speed": Column("Speed", "km/h", "m/s")})
    assert log.time == pytest.approx(4.0 + TIME)
    assert log["speed"] == pytest.approx(SPEED / 3.6)


def test_a_spreadsheet_counts_days_since_1900(tmp_path: Path) -> None:
    path = tmp_path / "serial.csv"
    path.write_text("Timestamp,v\n" + "".join(f"{46154 + t / 86400:.9f},{t}\n" for t in TIME))
    (clock,) = [f for f in survey(path) if f.state == "clock"]
    assert (clock.info.unit, clock.info.unit_from) == ("day", "rate")


def test_an_index_without_a_name_is_a_clock(tmp_path: Path) -> None:
    path = tmp_path / "index.csv"
    path.write_text(INDEX, encoding="utf-8")
    assert [f.column for f in survey(path) if f.state == "clock"] == ["Unnamed: 0"]
    log = read_log(path, {"time": Column("Unnamed: 0", "s", "s"), "speed": Column("speed_kmh", "km/h", "m/s")})
    assert log.time == pytest.approx(TIME)


@pytest.mark.parametrize(
    ("name", "content", "tool"),
    [
        ("a.asc", "date Tue May 12 10:00:00.000 am 2026\nbase hex  timestamps absolute\n", r"Vector \(.asc\)"),
        ("a.trc", ";$FILEVERSION=1.1\n;$STARTTIME=46154.4\n", r"PEAK \(.trc\)"),
        ("a.log", "(1770000000.000000) can0 1A0#2BB7000010200000\n", "candump"),
        ("a.blf", "LOGG\x90\0\0\0", r"Vector \(.blf\)"),
    ],
)
def test_a_trace_of_bus_frames_is_to_be_decoded_first(tmp_path: Path, name: str, content: str, tool: str) -> None:
    (tmp_path / name).write_text(content + "0.001 1 1A0 Rx d 8 00 01 02 03 04 05 06 07\n" * 9)
    with pytest.raises(InputError, match=rf"is a trace of bus frames by {tool}(?s:.*)DBC or ARXML"):
        survey(tmp_path / name)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ('<?xml version="1.0"?>\n<gpx version="1.1"><trk><trkseg>\n', "is XML, such as a GPX track(?s:.*)-i gpx"),
        ('[\n {\n  "t": 0.0,\n  "v": 30.0\n }\n]\n', "is JSON without a series of at least 10 objects"),
        ("$GPRMC,100000.00,A,4806.0000,N,01130.0000,E,58.00,90.0,120526,,,A*6C\n", "NMEA sentences"),
        ("# Name: a receiver\n$GPHDT,,T*1B\n$GPGGA,,,,,,0,,,,M,,M,,*66\n", "NMEA sentences(?s:.*)-i nmea"),
        ("<!DOCTYPE html>\n<html><body>Please, log in</body></html>\n", "is a web page"),
        (
            "Type,Local Number,Message,Field 1,Value 1,Units 1,\nData,0,record,speed,3,m/s,\n",
            "is a list of FIT messages",
        ),
        ("TimestampEpoch;BusChannel;ID;IDE;DLC;DataBytes\n1747213925.1;1;1F;1;8;0102\n", "is a trace of bus frames"),
        ("%DataLog%\nDataLogVersion : 1.1\nChannel : RPM\n", "is a Haltech log"),
        ("\x0e\x10\x1a\x08\x70\x17\x00\x00.FIT\x00", "is a FIT file(?s:.*)FitCSVTool"),
        ("MLVLG\x00\x00\x02", "is a log of MegaLogViewer"),
        ("version https://git-lfs.github.com/spec/v1\noid sha256:4d\nsize 12345\n", "git lfs pull"),
    ],
)
def test_text_without_a_table_is_called_what_it_is(tmp_path: Path, content: str, message: str) -> None:
    (tmp_path / "log.csv").write_text(content * 3)
    with pytest.raises(InputError, match=message):
        survey(tmp_path / "log.csv")


def test_the_vehicles_of_a_long_table_are_its_groups(tmp_path: Path) -> None:
    path = tmp_path / "race.csv"
    names = "expire_at,lap,meta_event,meta_time,original_vehicle_id,telemetry_name,telemetry_value,timestamp,vehicle_id"
    rows = [
        f",1,R1,x,{car},{name},{value},2026-07-17T19:16:{k / 10:06.3f}Z,{car}"
        for k in range(100)
        for car, gain in (("GR86-002", 1.0), ("GR86-004", 0.9))
        for name, value in (("speed", gain * (100.0 + k)), ("gear", 4.0))
    ]
    path.write_text("\n".join([names, *rows]) + "\n")
    assert [f.info.group for f in survey(path) if f.info.name == "speed"] == ["GR86-002", "GR86-004"]
    speed = Column("speed", "km/h", "m/s", group="GR86-004")
    log = read_log(path, {"time": Column("timestamp", "s", "s"), "speed": speed})
    assert log["speed"] == pytest.approx(0.9 * (100.0 + np.arange(100)) / 3.6)
    assert log.time == pytest.approx(np.arange(100) / 10)


def test_the_places_beside_the_values_of_a_long_table_are_channels(tmp_path: Path) -> None:
    path = tmp_path / "scanner.csv"
    rows = [
        f'"{100.0 + k / 10:.3f}";"{pid}";"{k}";"{unit}";"{(48.0 + k // 10 / 1e4) * (k > 9)}";"{9.0 * (k > 9)}";'
        for k in range(60)
        for pid, unit in (("Vehicle speed", "km/h"), ("Engine RPM", "rpm"))
    ]
    path.write_text("\n".join(['"SECONDS";"PID";"VALUE";"UNITS";"LATITUDE";"LONGTITUDE";', *rows]) + "\n")
    (place,) = [f for f in survey(path) if f.column == "LATITUDE"]
    assert (place.samples, place.lowest, place.info.unit) == (5, pytest.approx(48.0001), "deg")
    assert place.info.span == pytest.approx((101.0, 105.0))


def test_the_clock_of_a_long_table_has_its_unit(tmp_path: Path) -> None:
    path = tmp_path / "long.csv"
    path.write_text("Time (ms),Signal,Value,Unit\n" + rows("{t:.3f},Speed,{v:.2f},km/h"))
    (clock,) = [f for f in survey(path) if f.state == "clock"]
    assert clock.info.unit == "ms"
    with pytest.raises(InputError, match="channel 'time' is read in 's'"):
        read_log(path, {"time": Column("Time (ms)", "s", "s"), "speed": Column("Speed", "km/h", "m/s")})


@pytest.mark.parametrize("name", EXPORTS)
def test_the_channels_of_an_export_are_listed_with_their_units(tmp_path: Path, name: str) -> None:
    content, _, speed, unit = EXPORTS[name]
    path = tmp_path / name
    path.write_text(content, encoding="utf-8", newline="")
    listed = {f.info.name: f for f in survey(path)}
    assert listed[speed].info.unit == unit
    assert listed[speed].info.rate == pytest.approx(20.0, rel=1e-3)


def test_units_of_degrees_and_with_capitals_are_known(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("Time;Speed (Meters/second);Bearing\nDD.MM.YYYY hh:mm;;°\n0;1;2\n1;3;4\n", encoding="utf-8")
    assert {f.info.name: f.info.unit for f in survey(path)}["Speed (Meters/second)"] == "Meters/second"
    path = tmp_path / "long.csv"
    path.write_text(LONG, encoding="utf-8")
    assert {f.info.name: f.info.unit for f in survey(path)}["Intake air temperature"] == "°F"
    path = tmp_path / "station.csv"
    path.write_text(STATION, encoding="utf-8")
    found = {f.info.name: f.info.unit for f in survey(path)}
    assert (found["Temperature"], found["Direction"], found["Notes"]) == ("°C", "Deg", "")


def test_a_row_that_repeats_the_one_before_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    columns = {"time": Column("t", "s", "s"), "speed": Column("v", "m/s", "m/s")}
    path.write_text("t;v\n0;5\n1;4\n1;4\n2;3\n3;2\n", encoding="utf-8")
    log = read_log(path, columns)
    assert log.time == pytest.approx([0.0, 1.0, 2.0, 3.0])
    assert [f.what for f in log.findings] == ["1 row left out: equal to the row before (line 4)"]
    path.write_text("t;v\n0;5\n1;4\n1;4.5\n2;3\n3;2\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"repeats in 1 row \(line 4\)"):
        read_log(path, columns)


def test_positions_of_a_vbo_are_degrees_to_the_north_and_east(tmp_path: Path) -> None:
    path = tmp_path / "vbox.vbo"
    path.write_text(VBO, encoding="utf-8", newline="")
    listed = {f.info.name: f for f in survey(path)}
    assert (listed["lat"].lowest, listed["long"].lowest) == pytest.approx((51.98500, -0.97488), abs=1e-5)
    assert (listed["Front_Load"].info.unit, listed["Brake"].info.unit) == ("kN", "")


def test_a_vbo_without_data_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "vbox.vbo"
    path.write_text(VBO[: VBO.index("[data]")], encoding="utf-8", newline="")
    with pytest.raises(InputError, match=r"no section \[data\]"):
        survey(path)


def test_a_clock_of_several_tables_is_offered_by_its_plain_name(tmp_path: Path) -> None:
    """Each channel of a long table has its own clock, and all clocks are named ``SECONDS``."""
    path = tmp_path / "long.csv"
    path.write_text(LONG, encoding="utf-8")
    columns = {"time": Column("SECOND", "s", "s"), "speed": Column("Vehicle speed", "km/h", "m/s")}
    with pytest.raises(InputError, match=r"did you mean 'SECONDS'\?"):
        read_log(path, columns)


def test_the_clock_of_a_vbox_file_states_its_time_of_day(tmp_path: Path) -> None:
    path = tmp_path / "a.vbo"
    path.write_text(VBO, encoding="utf-8")
    (clock,) = [one for one in survey(path) if one.state == "clock"]
    assert clock.info.begin == pytest.approx(86390.0)
    assert clock.info.span[0] == 0.0


@pytest.mark.parametrize("line", ["sep=;", '"SEP=;"'])
def test_the_delimiter_in_the_first_line_for_excel_is_no_column(tmp_path: Path, line: str) -> None:
    (tmp_path / "a.csv").write_text(f"{line}\r\nt [s];n [1/min]\r\n0,0;1.234,5\r\n0,1;1.233,5\r\n0,2;1.232,5\r\n")
    assert [(f.column, f.highest) for f in survey(tmp_path / "a.csv")] == [("t [s]", 0.2), ("n [1/min]", 1234.5)]


def test_two_clocks_of_the_same_rows_are_one_table(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("Time,v,UTC Time,w\n" + rows("{t:.2f},{v},{u:.2f},{v}"), encoding="utf-8")
    assert [f.column for f in survey(path) if f.state == "clock"] == ["Time"]


def test_marks_of_the_driver_between_the_samples_are_left_out(tmp_path: Path) -> None:
    path = tmp_path / "log.msl"
    lines = rows("{t:.2f}\t{v}").splitlines()
    path.write_text("\n".join(["Time\tVSS", "s\tkm/h", *lines[:9], "MARK 001 - Tue May 12 09:12:20", *lines[9:]]))
    log = read_log(path, {"time": Column("Time", "s", "s"), "speed": Column("VSS", "km/h", "m/s")})
    assert log["speed"] == pytest.approx(SPEED / 3.6)
    assert [str(f) for f in log.findings] == [
        "log.msl: left out: rows of text without a value (1: line 12) (got 'MARK 001 - Tue May 12 09:12:20')"
    ]


def test_the_finer_of_two_clocks_is_chosen(tmp_path: Path) -> None:
    """As Torque writes them: GPS Time in full seconds, Device Time in milliseconds."""
    path = tmp_path / "log.csv"
    path.write_text("GPS Time,Device Time,v\n" + rows("{d:%H:%M:%S},{d:%H:%M:%S.%f},{v}"), encoding="utf-8")
    assert [f.column for f in survey(path) if f.state == "clock"] == ["Device Time"]


def test_a_clock_that_steps_back_is_shown_with_its_place(tmp_path: Path) -> None:
    """Each part begins late in the one before: the file is not a row of recordings."""
    path = tmp_path / "log.csv"
    parts = ("".join(f"{t + start:.2f},{v}\n" for t, v in zip(TIME, SPEED, strict=True)) for start in (0, 20, 40))
    path.write_text("time_s,v\n" + "".join(parts), encoding="utf-8")
    what, remedy = without_clock(survey(path))
    assert what.endswith("its values do not increase: 29.95 is followed by 20, and 1 more")
    assert "split the file where its time steps back" in remedy


def test_a_receiver_s_clock_in_digits_is_named_utc(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("Date,UTC,Speed (knots)\n" + rows("010526,{d:%H%M%S.%f},{v:.2f}"), encoding="utf-8")
    (clock,) = [f for f in survey(path) if f.state == "clock"]
    assert (clock.column, clock.info.unit, clock.info.begin) == ("UTC", "s", pytest.approx(86390.0))


def test_a_row_of_ranges_below_the_header_is_no_sample(tmp_path: Path) -> None:
    path = tmp_path / "ranges.csv"
    path.write_text("Time;v;U\ns;km/h;V\n1 ms;250 km/h;10 V\n" + rows("{t:.2f};{v:.2f};1.5"), encoding="utf-8")
    log = read_log(path, {"time": Column("Time", "s", "s"), "speed": Column("v", "km/h", "m/s")})
    assert log["speed"] == pytest.approx(SPEED / 3.6)
    assert any("row between header and numbers skipped" in f.what for f in log.findings)


def test_a_count_of_records_above_the_names_is_no_header(tmp_path: Path) -> None:
    """As CompuTrainer writes them: two of the names, ms and rpm, are units, too."""
    path = tmp_path / "ride.txt"
    head = "[USER DATA]\nAGE=20\n[END USER DATA]\n\nnumber of records = 600\n\nms speed watts rpm hr KM\n\n"
    lines = (
        f" {1000 * t:.0f}   {v:.2f}     0   {k % 7}   60   {t:.4f}\n"
        for k, (t, v) in enumerate(zip(TIME, SPEED, strict=True))
    )
    path.write_text(head + "".join(lines), encoding="utf-8")
    found = {f.column: f for f in survey(path)}
    assert list(found) == ["ms", "speed", "watts", "rpm", "hr", "KM"]
    assert (found["ms"].state, found["ms"].info.unit, found["ms"].info.span) == ("clock", "ms", (0.0, 29.95))


def test_the_time_of_a_receiver_in_its_own_rows_is_not_the_clock(tmp_path: Path) -> None:
    """RaceCapture: the interval in every row, UTC in those of the satellite receiver."""
    path = tmp_path / "rc.log"
    rows = [f"{402 + 40 * k},{1777843842000 + 40 * k if k % 5 == 0 else ''},{60 - 0.1 * k}" for k in range(300)]
    head = '"Interval"|"ms"|0|0|1,"Utc"|"ms"|0|0|1,"Speed"|"mph"|0.0|150.0|25\n'
    path.write_text(head + "\n".join(rows) + "\n")
    assert [one.column for one in survey(path) if one.state == "clock"] == ["Interval"]


def test_a_header_with_a_name_too_many_is_told_from_a_damaged_clock(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("v=1,t_ms,x,v,mark\n" + "".join(f"{10 * k},0,{k},{50 - k}\n" for k in range(40)))
    assert without_clock(survey(path))[1].startswith("the last column, 'mark', is empty: if the header has a name too")


def test_a_message_that_is_logged_once_is_listed(tmp_path: Path) -> None:
    rows = [{"name": "vehicle_speed", "value": 50.0 - k, "timestamp": 100.0 + 0.1 * k} for k in range(30)]
    rows.insert(5, {"name": "ignition_status", "value": 1, "timestamp": 100.44})
    path = tmp_path / "openxc.json"
    path.write_text("\n".join(json.dumps(row) for row in rows), encoding="utf-8")
    assert [f.column for f in survey(path) if f.state != "clock"] == ["vehicle_speed", "ignition_status"]
