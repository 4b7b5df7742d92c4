"""Channels of different rates in one table are read at the rows that contain their values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from vdyn_cli.io.clocks.changed_values import rows_until_change
from vdyn_cli.io.clocks.mixed_rates import slower_rows
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.reader import Column
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log

N = 4000
TIME = np.arange(N) / 100.0
RANDOM = np.random.default_rng(1)


@pytest.mark.parametrize("every", [2, 5, 10])
def test_every_kth_row_is_a_slower_clock(every: int) -> None:
    values = np.full(N, np.nan)
    values[3::every] = 1.0
    assert slower_rows(TIME, values) == pytest.approx(np.arange(3, N, every))


def test_a_slower_clock_is_no_multiple_of_the_table_s() -> None:
    rows = np.unique(np.round(np.arange(0, N - 1, 8.53)).astype(int))
    values = np.full(N, np.nan)
    values[rows] = 1.0
    assert slower_rows(TIME, values) == pytest.approx(rows)


@pytest.mark.parametrize(
    "lost",
    [RANDOM.random(N) < 0.1, RANDOM.random(N) < 0.5, np.arange(N) % 3 == 0, np.arange(N) % 9 == 0, TIME > 20.0],
    ids=["a tenth", "a half", "every third", "every ninth", "a gap"],
)
def test_missing_values_are_no_slower_clock(lost: NDArray[np.bool_]) -> None:
    assert slower_rows(TIME, np.where(lost, np.nan, 1.0)) is None


def bus(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A table with one row per message: torque every 10 ms, speed every 20 ms; and their times."""
    torque, speed = np.arange(0.0, 20.0, 0.01), np.arange(0.0033, 20.0, 0.02)
    rows = sorted([(t, f"{t:.4f};{t:.4f};") for t in torque] + [(t, f"{t:.4f};;{30.0 - t:.4f}") for t in speed])
    path.write_text("\n".join(["t;Torque;Speed", *(row for _, row in rows)]) + "\n")
    return torque, speed


def test_messages_of_a_bus_are_read_on_their_own_clocks(tmp_path: Path) -> None:
    torque, speed = bus(tmp_path / "log.csv")
    clock = {"time": Column("t", "s", "s")}
    columns = {"drive_torque": Column("Torque", "N m", "N m"), "speed": Column("Speed", "m/s", "m/s")}
    log = read_log(tmp_path / "log.csv", clock | columns)
    assert log.time == pytest.approx(torque)
    assert log["speed"][5:-5] == pytest.approx(30.0 - torque[5:-5], abs=1e-6)
    assert log.samples["speed"][0] == pytest.approx(speed, abs=1e-4)
    log = read_log(tmp_path / "log.csv", clock | dict(reversed(columns.items())))
    assert log.time == pytest.approx(speed, abs=1e-4)
    assert log["drive_torque"][5:-5] == pytest.approx(speed[5:-5], abs=1e-2)


def test_a_height_every_20_s_does_not_question_the_unit_of_time(tmp_path: Path) -> None:
    path = tmp_path / "mission.csv"
    rows = [f"{k},{10 + np.sin(k / 30):.3f},{408 if k % 20 == 0 else ''}" for k in range(900)]
    path.write_text("\n".join(["time [s],speed [m/s],height [m]", *rows]) + "\n")
    columns = {"time": Column("time [s]", "s", "s"), "speed": Column("speed [m/s]", "m/s", "m/s")}
    log = read_log(path, {**columns, "elevation": Column("height [m]", "m", "m")})
    assert not [f for f in log.findings if "typical step" in f.what]


def test_a_finding_names_the_line_of_the_file(tmp_path: Path) -> None:
    lines = ["t,v,x", *(f"{k / 10},{k if k % 2 else ''},{k}" for k in range(400))]
    lines[202] = "20.1,1e4,201"
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    log = read_log(tmp_path / "log.csv", {"time": Column("t", "s", "s"), "speed": Column("v", "m/s", "m/s")})
    assert log.time[0] == 0.1
    assert log["speed"][100] == 1e4


def table_of_changes(path: Path, repeated: bool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rows every 10 ms of a speed that changes by quanta of 0.1 km/h, and a brake that is applied once; the signals.

    Only changes are written, or (``repeated``) a tenth of the values, at random.
    """
    time = np.arange(6000) / 100.0
    speed = np.round((50.0 + 20.0 * np.sin(time / 7.0)) * 10.0) / 10.0
    brake = np.where((time >= 40.0) & (time < 45.0), 400.0, 0.0)
    dense = np.round(100.0 * np.sin(time / 3.0), 4)
    shown = RANDOM.random(time.size) < 0.1 if repeated else np.r_[True, np.diff(speed) != 0.0]
    braked = RANDOM.random(time.size) < 0.1 if repeated else np.r_[True, np.diff(brake) != 0.0]
    cells = zip(time, dense, np.where(shown, speed, np.nan), np.where(braked, brake, np.nan), strict=True)
    rows = [",".join("" if np.isnan(x) else f"{x:.10g}" for x in row) for row in cells]
    path.write_text("\n".join(["t,Torque,Speed,Brake", *rows]) + "\n")
    return speed, brake


def test_blanks_hold_the_last_value_where_only_changes_are_written(tmp_path: Path) -> None:
    speed, brake = table_of_changes(tmp_path / "log.csv", repeated=False)
    columns = {"time": Column("t", "s", "s"), "drive_torque": Column("Torque", "N m", "N m")}
    columns |= {"speed": Column("Speed", "km/h", "km/h"), "brake_torque": Column("Brake", "N m", "N m")}
    log = read_log(tmp_path / "log.csv", columns)
    assert any("written only where the value changes: 'speed', 'brake_torque'" in f.what for f in log.findings)
    assert np.abs(log["speed"] - speed).max() < 0.11
    assert np.abs(log["brake_torque"] - brake)[:3960].max() == 0.0  # until shortly before the brake


def test_values_that_are_missing_at_random_are_not_held(tmp_path: Path) -> None:
    table_of_changes(tmp_path / "log.csv", repeated=True)
    columns = {"time": Column("t", "s", "s"), "speed": Column("Speed", "km/h", "km/h")}
    with pytest.raises(InputError, match="has no value in"):
        read_log(tmp_path / "log.csv", columns)


def test_regular_samples_beside_a_channel_of_changes_stay_as_they_are() -> None:
    """A receiver of 10 Hz, which loses its signal for 20 s, in the table of a pedal that is written at changes."""
    time = np.arange(6000) / 100.0
    pedal = np.round(50.0 + 40.0 * np.sin(time / 5.0))
    speed = np.where(np.arange(6000) % 10 == 3, np.round(25.0 - 0.15 * time + 0.3 * np.sin(time), 3), np.nan)
    speed[(time > 20.0) & (time < 40.0) | (time > 55.0)] = np.nan
    log = Log("log.csv", time, {"speed": speed, "pedal": np.where(np.diff(pedal, prepend=0.0) != 0.0, pedal, np.nan)})
    found = rows_until_change(log)
    assert list(found) == ["speed", "pedal"]
    assert found["speed"].tolist() == np.flatnonzero(np.isfinite(speed)).tolist()
    assert found["pedal"].size > 1.5 * np.isfinite(log["pedal"]).sum()
