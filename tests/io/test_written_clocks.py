"""Clocks as loggers write them: times of day, months in several languages, digits, counters and restarts."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from vdyn_cli.io.channel_survey import survey
from vdyn_cli.io.clocks.written_times import is_instant, seconds_of_digits, since_first, written_seconds
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.reader import Column, ReadOptions

N = 600
TIME = np.arange(N) / 20.0
SPEED = np.round(70.0 - 0.8 * TIME, 2)  # km/h


@pytest.mark.parametrize(
    ("date", "month"),
    [("01-Mär-2026", 3), ("01-Okt-2026", 10), ("1 août 2026", 8), ("1 juil. 2026", 7), ("1 juin 2026", 6),
     ("01-ene-2026", 1), ("01-dic-2026", 12), ("01-ago-2026", 8), ("01-gen-2026", 1), ("01-set-2026", 9),
     ("01-fev-2026", 2), ("01-out-2026", 10), ("01-Dec-2026", 12), ("01-mars-2026", 3)],
)  # fmt: skip
@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_the_months_of_several_languages_are_known(date: str, month: int, encoding: str) -> None:
    cell = f"{date} 10:23:11".encode(encoding).decode("latin-1")
    assert is_instant(cell)
    (seconds,) = written_seconds(np.array([cell], dtype=object))
    assert seconds == datetime(2026, month, 1, 10, 23, 11, tzinfo=UTC).timestamp()


@pytest.mark.parametrize(
    "values", [TIME, TIME + 40.0, TIME + 1e5, TIME[::20] * 20.0, 100.0 * TIME, np.array([0.0, 55.2, 101.0, 120.3])]
)
def test_other_clocks_are_no_digits_of_a_time_of_day(values: NDArray[np.float64]) -> None:
    assert seconds_of_digits(values, "Time") is None


def test_the_name_of_a_clock_shows_its_digits_within_a_minute() -> None:
    within = 91204.0 + np.arange(0.0, 50.0, 0.05)
    assert seconds_of_digits(within, "Time") is None
    assert seconds_of_digits(within, "Time (HHMMSS.SS)") == pytest.approx(9 * 3600 + 12 * 60 + within - 91200.0)


def test_a_named_clock_in_digits_may_lack_samples_at_a_full_minute() -> None:
    seconds = np.r_[np.arange(50.0, 57.7, 0.05), np.arange(62.0, 70.0, 0.05)]
    digits = 91200.0 + seconds + 40.0 * (seconds >= 60.0)
    assert seconds_of_digits(digits, "Time") is None
    assert seconds_of_digits(digits, "Time (HHMMSS.SS)") == pytest.approx(9 * 3600 + 12 * 60 + seconds)


@pytest.mark.parametrize(
    ("head", "clock_name", "speed_name"),
    [
        (
            "header.stamp.sec,header.stamp.nanosec,frame,twist.twist.linear.x\n",
            "header.stamp.sec",
            "twist.twist.linear.x",
        ),
        ("", "column 1", "column 4"),
    ],
)
def test_a_stamp_of_seconds_and_nanoseconds_is_one_clock(
    head: str, clock_name: str, speed_name: str, tmp_path: Path
) -> None:
    path = tmp_path / "odometry.csv"
    cells = [divmod(round(1e9 * float(t)) + 713_000_000, 10**9) for t in TIME]
    lines = [f"{1_778_580_000 + s},{ns},odom,{v / 3.6:.6f}" for (s, ns), v in zip(cells, SPEED, strict=True)]
    path.write_text(head + "\n".join(lines) + "\n")
    (clock,) = [f for f in survey(path) if f.state == "clock"]
    assert (clock.column, clock.info.unit) == (clock_name, "s")
    columns = {"time": Column(clock_name, "s", "s"), "speed": Column(speed_name, "m/s", "m/s")}
    assert read_log(path, columns).time == pytest.approx(1_778_580_000.713 + TIME, abs=1e-6)


def test_a_clock_with_late_rows_is_listed_as_far_as_it_is_read(tmp_path: Path) -> None:
    """Nine in a hundred times are late by three steps, as a phone writes fixes; the rows are left out by a key."""
    time = np.where(np.random.default_rng(1).random(TIME.size) < 0.09, TIME - 0.17, TIME)
    path = tmp_path / "log.csv"
    path.write_text("time [s],v [m/s]\n" + "".join(f"{t:.2f},{v}\n" for t, v in zip(time, SPEED, strict=True)))
    (clock,) = [f for f in survey(path) if f.state == "clock"]
    columns = {"time": Column("time [s]", "s", "s"), "speed": Column("v [m/s]", "m/s", "m/s")}
    log = read_log(path, columns, ReadOptions(clock="drop"))
    assert clock.info.late == TIME.size - log.time.size > 0.05 * TIME.size


def test_a_clock_counts_nanoseconds_since_1970(tmp_path: Path) -> None:
    path = tmp_path / "location.csv"
    lines = [f"{1_778_580_000_000_000_000 + int(1e9 * t)},{t:.3f},{v}" for t, v in zip(TIME, SPEED, strict=True)]
    path.write_text("\n".join(["time,seconds_elapsed,speed", *lines]) + "\n")
    (clock,) = [f for f in survey(path) if f.state == "clock"]
    assert (clock.info.unit, clock.info.unit_from) == ("ns", "rate")


def test_a_clock_of_hours_is_passed_over_for_one_of_a_usual_rate(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    lines = "\n".join(f"{k};{1.68e9 + t:.2f};9;{17.07 + t / 3600:.9f}" for k, t in enumerate(TIME))
    path.write_text(f"rec_id;obc_timeStamp;v;Time\n{lines}\n", encoding="utf-8")
    assert [f.column for f in survey(path) if f.state == "clock"] == ["obc_timeStamp"]


@pytest.mark.parametrize(
    "cell", ["10:23:11", "10:23:11,5", "2026-05-01T10:23:11.123456Z", "1.5.2026 10:23:11", "01-May-2026 10:23:11.023",
             "2026/05/01 10:23:11+02:00", "5/1/2026 10:23:11 PM", "1/5/2026, 10:23:11,5 CEST", "20260501 10:23:11.5",
             "2026-05-01 10:23:11 Europe/Berlin", "2026-05-01T10:23:11+02:00[Europe/Berlin]", "10:23:11 UTC+2",
             "5/1/2026, 10:23:11\u202fPM", "2026/05/01-10:23:11.5"]
)  # fmt: skip
def test_a_time_of_day_is_distinguished_from_a_number(cell: str) -> None:
    assert is_instant(cell)
    assert written_seconds(np.array([cell], dtype=object))[0] % 86400 == pytest.approx(
        (22 if "PM" in cell else 10) * 3600 + 23 * 60 + 11, abs=0.6
    )


@pytest.mark.parametrize("cell", ["1.5", "12:30", "1e5", "", "Time", "10:23", "1:2:3", "x 10:23:11", "10:23:11 lap"])
def test_other_cells_are_no_time_of_day(cell: str) -> None:
    assert not is_instant(cell)


@pytest.mark.parametrize("days", [("03/07/2026", "03/08/2026"), ("07/03/2026", "08/03/2026")])
def test_two_dates_of_one_night_show_whether_the_month_is_first(days: tuple[str, str]) -> None:
    cells = np.array([f"{days[0]} 23:59:59.5", f"{days[1]} 00:00:00.5"], dtype=object)
    assert np.diff(written_seconds(cells)) == 1.0


def test_a_clock_of_twelve_hours_passes_one_o_clock() -> None:
    cells = np.array(["12:59:59.5", "01:00:00.5", "01:00:01.5"], dtype=object)
    assert np.array_equal(since_first(written_seconds(cells)), [0.0, 1.0, 2.0])


def test_a_clock_passes_midnight_twice() -> None:
    seconds = np.array([86399.0, np.nan, 1.0, 86399.5, 0.5])
    assert since_first(seconds) == pytest.approx([0.0, np.nan, 2.0, 86400.5, 86401.5], nan_ok=True)


@pytest.mark.parametrize(
    ("cell", "since_midnight"),
    [("2026-05-01 09:05", 32700.0), ("5/1/2026 9:05 PM", 75900.0), ("9:05 pm", 75900.0), ("09:05", None)],
)
def test_a_minute_is_an_instant_behind_a_date_or_before_am_and_pm(cell: str, since_midnight: float | None) -> None:
    """``09:05`` alone may be minutes and seconds."""
    assert is_instant(cell) == (since_midnight is not None)
    if since_midnight is not None:
        assert written_seconds(np.array([cell], dtype=object))[0] % 86400.0 == since_midnight


@pytest.mark.parametrize("form", ["%H:%M", "%H:%M:%S", "%I:%M%p", "%I:%M:%S %p"])
@pytest.mark.parametrize("names", ["Date\tTime", "Time\tDate"])
def test_separate_columns_of_dates_and_times_are_one_instant(tmp_path: Path, form: str, names: str) -> None:
    """A weather station's export over midnight, with its wind as points of the compass."""
    path = tmp_path / "station.txt"
    begin = datetime(2025, 9, 17, 23, 45, tzinfo=UTC)
    moments = [begin + timedelta(minutes=m) for m in range(40)]
    cells = [(f"{at:%d.%m.%y}", f"{at:{form}}".replace("AM", "a").replace("PM", "p")) for at in moments]
    order = slice(None, None, 1 if names.startswith("Date") else -1)
    lines = ["\t".join((*at[order], f"{21 + 0.1 * m:.1f}", "ENE" if m else "---")) for m, at in enumerate(cells)]
    path.write_text("\n".join([f"{names}\tTemp Out\tWind Dir", *lines]) + "\n")
    found = {one.column: one for one in survey(path)}
    assert found["Time"].state == "clock"
    assert found["Time"].info.begin == begin.timestamp()
    assert found["Time"].info.span == (0.0, 39 * 60.0)
    assert found["Date"].state == "text"
    wind = found["Wind Dir"]
    assert (wind.state, wind.samples, wind.lowest, wind.info.unit) == ("constant", 39, 67.5, "deg")
    log = read_log(path, {"time": Column("Time", "s", "s"), "temperature": Column("Temp Out", "degC", "K")})
    assert log.time == pytest.approx(60.0 * np.arange(40))


@pytest.mark.parametrize("names", [("Time [s]", "Time [s]"), ("t_VehSpd [s]", "t_Gear [s]"), ("Time84", "TimeVBOX")])
def test_tables_side_by_side_have_their_own_clocks(tmp_path: Path, names: tuple[str, str]) -> None:
    """As programs write channels of different rates, and VCDS its groups: a time beside the values of each."""
    path = tmp_path / "beside.csv"
    slow = [f"{t:.1f},{np.sin(t):.5f}" for t in 0.013 + np.arange(0.0, 30.0, 0.1)]
    lines = [
        f"{t:.2f},{v},{slow[k] if k < len(slow) else ','}" for k, (t, v) in enumerate(zip(TIME, SPEED, strict=True))
    ]
    path.write_text(f"{names[0]},Speed [km/h],{names[1]},a [m/s2]\n" + "\n".join(lines) + "\n", encoding="utf-8")
    found = {f.column: (f.info.group, round(f.info.rate)) for f in survey(path)}
    assert found["Speed [km/h]"] == ("table 1", 20)
    assert found["a [m/s2]"] == ("table 2", 10)
    columns = {
        "time": Column(names[0], "s", "s"),
        "speed": Column("Speed [km/h]", "km/h", "m/s"),
        "acceleration": Column("a [m/s2]", "m/s2", "m/s^2"),
    }
    log = read_log(path, columns)
    assert log.time == pytest.approx(TIME)
    known = np.isfinite(log["acceleration"])
    assert known.sum() > 500
    assert log["acceleration"][known] == pytest.approx(np.sin(TIME[known] + 0.013), abs=0.06)


@pytest.mark.parametrize(
    "cell",
    ["20260501T102311.5Z", "20260501-102311", "20260501_102311.25", "20260501 102311+02:00", "2026_05_01_10_23_11_500"],
)
def test_a_time_without_separators_is_read(cell: str) -> None:
    assert is_instant(cell)
    expected = datetime(2026, 5, 1, 10, 23, 11, tzinfo=UTC).timestamp()
    assert written_seconds(np.array([cell], dtype=object))[0] == pytest.approx(expected, abs=0.6)


def test_a_counter_of_seconds_that_stops_early_is_no_clock_of_the_columns_after_it(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    lines = [f"{t:.2f},1,{t if t < 9.0 else ''},{v}" for t, v in zip(TIME, SPEED, strict=True)]
    path.write_text("Time (s),Gear,Trip time (s),v [km/h]\n" + "\n".join(lines) + "\n", encoding="utf-8")
    assert [f.column for f in survey(path) if f.state == "clock"] == ["Time (s)"]
    log = read_log(path, {"time": Column("Time (s)", "s", "s"), "speed": Column("v [km/h]", "km/h", "m/s")})
    assert log["speed"] == pytest.approx(SPEED / 3.6)


def test_a_clock_of_minutes_passes_the_hour_unless_it_pauses() -> None:
    minutes = np.r_[3598.0, 3599.0, 0.0, 1.0, 2.0]
    assert since_first(minutes).tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    restarted = np.r_[1800.0:1803.0, 0.0:3.0]  # a second recording, not half an hour later
    assert since_first(restarted).tolist() == [0.0, 1.0, 2.0, -1800.0, -1799.0, -1798.0]


def test_a_clock_is_set_back_at_the_end_of_summer_time_unless_it_pauses() -> None:
    """25 October 2026, 2:59:50 to 2:00:10; a log that starts again somewhat earlier is another recording."""
    begin = datetime(2026, 10, 25, 2, 59, 50, tzinfo=UTC).timestamp()
    gone = np.arange(0.0, 20.0, 0.5)
    clock = begin + gone - 3600.0 * (gone >= 10.0)
    assert since_first(clock) == pytest.approx(gone)
    assert since_first(clock - 300.0) == pytest.approx(clock - begin)
    assert since_first(clock + 20.0 * (gone >= 10.0))[-1] < 0.0


def test_a_clock_since_midnight_goes_on_after_it(tmp_path: Path) -> None:
    clock = (86_390.0 + TIME) % 86_400.0
    path = tmp_path / "night.csv"
    rows = "".join(f"{t:.2f},{v}\n" for t, v in zip(clock, SPEED, strict=True))
    path.write_text("Time from midnight (s),Velocity (km/h)\n" + rows, encoding="utf-8")
    listed = survey(path)[0].info
    assert listed.span == pytest.approx((86_390.0, 86_390.0 + TIME[-1]))
    columns = {"time": Column("Time from midnight (s)", "s", "s"), "speed": Column("Velocity (km/h)", "km/h", "m/s")}
    assert read_log(path, columns).time == pytest.approx(86_390.0 + TIME)
