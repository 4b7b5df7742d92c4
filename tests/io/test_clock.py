"""Clocks: rows whose time does not increase are refused or removed, never sorted; gaps and jitter are reported."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from vdyn_cli.io.clocks.sample_times import Rising, check_rising, check_steps
from vdyn_cli.io.reader import is_clock
from vdyn_cli.quantities.log import Log, LogSource

Array = NDArray[np.float64]


def line_of(row: int) -> int:
    return row + 2


def rising(time: list[float] | Array, mode: str = "strict") -> Rising:
    return check_rising(np.array(time, dtype=float), mode, "run.csv", line_of)  # type: ignore[arg-type]


def steps(time: Array) -> str:
    return "\n".join(str(f) for f in check_steps(Log("run.csv", time, {}, source=LogSource({"time": "t"}, line_of))))


def test_a_rising_clock_is_silent() -> None:
    assert rising([0.0, 0.1, 0.2]) == Rising(None)


def test_dropping_leaves_a_rising_clock_and_says_how_many_rows_it_cost() -> None:
    time = np.array([0, 1, 2, 2, 3, 4, 3.5, 3.9, 5, 6, 7, 8, 9, 10, 11, np.nan, 12, 13, 14, 15, 16, 17])
    found = rising(time, "drop")
    assert found.kept is not None
    assert not found.problems
    assert time[found.kept].tolist() == [float(t) for t in range(18)]
    text = str(found.findings[0])
    assert "is missing in 1 row (line 17)" in text
    assert "repeats in 1 row (line 5)" in text
    assert "steps back in 2 rows (line 8, 9)" in text
    assert "4 rows left out" in text


def test_a_clock_that_restarts_is_not_dropped_away() -> None:
    time = np.concatenate([np.arange(100) * 0.1, np.arange(60) * 0.1])
    for mode in ("drop", "strict"):
        found = rising(time, mode)
        assert "time restarts at 0 s at line 102\n" in str(found.problems[0])
        assert "the file has 2 recordings: list it as one run for each, with 'recording: 1'" in found.problems[0].remedy
    time[10] = 0.0  # one wrong time is no recording
    assert "more than 20 % of the rows would be left out" in rising(time, "drop").problems[0].remedy


def test_one_wild_time_stamp_does_not_drop_the_rest() -> None:
    time = np.arange(100) * 0.1
    time[10] = 1e9
    assert rising(time, "drop").problems


def test_a_clock_written_too_coarsely_gets_its_own_remedy() -> None:
    found = rising(np.floor(np.arange(100) * 0.01 * 10) / 10)
    assert "export it with more digits" in found.problems[0].remedy


@pytest.mark.parametrize("rate", [0.2, 1.0, 10.0, 85.3, 1000.0, 50_000.0])
def test_regular_clocks_are_silent(rate: float) -> None:
    assert steps(np.arange(2000) / rate) == ""
    assert steps(1.7e9 + np.arange(2000) / min(rate, 1000.0)) == ""


def test_a_clock_rounded_to_its_last_digit_has_no_gaps() -> None:
    assert "gap" not in steps(np.round(np.arange(3000) / 300.0, 3))


def test_usual_jitter_has_no_gaps() -> None:
    rng = np.random.default_rng(3)
    assert steps(np.cumsum(0.01 + rng.normal(0.0, 0.0002, 5000))) == ""


def test_gaps_are_counted_and_placed() -> None:
    time = np.arange(1000) * 0.01
    time[400:] += 0.01
    time[700:] += 2.0
    assert "2 gaps in the clock, 2.01 s in all (typical step 0.01 s): after line 401, 701" in steps(time)
    assert "the longest is 2.01 s after line 701" in steps(time)


def test_an_uneven_clock_is_said() -> None:
    rng = np.random.default_rng(5)
    assert "uneven clock: 90 % of the steps lie between" in steps(np.cumsum(rng.uniform(0.005, 0.015, 2000)))


def test_two_loggers_written_into_one_file_are_uneven() -> None:
    time = np.unique(np.concatenate([np.arange(1000) * 0.01, 0.003 + np.arange(120) * 0.083]))
    assert "uneven clock" in steps(time)


def test_a_clock_in_another_unit_is_doubted() -> None:
    assert "check the unit of time" in steps(np.arange(1000) * 20.0)
    assert "check the unit of time" in steps(np.arange(1000) * 1e-6)


@pytest.mark.parametrize(
    "name",
    [
        "Device Time",
        "GPS Time",
        "UTC time (HHMMSS.SSS)",
        "Elapsed Time (s)",
        "system_time",
        "Zeit (s)",
        "Uhrzeit",
        "t",
        "logMonoTime",
    ],
)
def test_a_clock_is_known_by_the_names_that_loggers_give_it(name: str) -> None:
    assert is_clock(name)


@pytest.mark.parametrize("name", ["Torque", "GPS Speed (m/s)", "GPS Timing Error", "Device Temperature", "throttle"])
def test_other_channels_of_such_loggers_are_no_clocks(name: str) -> None:
    assert not is_clock(name)


def test_a_clock_of_full_seconds_may_have_a_fixed_rate() -> None:
    time = np.floor(np.arange(200) / 10.0)
    assert "remove 'time' and write 'reading: {rate: 10 Hz}'" in rising(time).problems[0].remedy


def test_a_clock_of_full_seconds_keeps_its_rate_at_rest_and_with_uneven_seconds() -> None:
    """Rows of a car at rest are equal within a second; a logger's 10 Hz may give 9 or 11 rows in one."""
    time = np.floor(np.arange(200) / 10.0)
    time[[30, 80]] -= 1.0
    speed = np.maximum(120.0 - np.arange(200.0), 0.0)
    problem = check_rising(time, "strict", "log.csv", int, channels={"speed": speed}).problems[0]
    assert "'reading: {rate: 10 Hz}'" in problem.remedy
