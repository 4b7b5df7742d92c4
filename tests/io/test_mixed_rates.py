"""Channels of different rates in one table are read at the rows that contain their values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from vdyn_cli.io.clocks.mixed_rates import slower_rows
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.reader import Column

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
