"""The unit of a clock that the file does not state in brackets or a units row."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vdyn_cli.io.channel_survey import ChannelFacts, survey
from vdyn_cli.io.clocks.clock_unit import unit_of_name
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.reader import Column, clock_units

TIME = np.arange(0.0, 20.0, 0.1)


def clock_of(path: Path) -> ChannelFacts:
    return next(f for f in survey(path) if f.state == "clock")


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("time_ms", "ms"), ("timestampMs", "ms"), ("ms_today", "ms"), ("time_s", "s"), ("SECONDS", "s"), ("t_us", "us"),
        ("seconds_elapsed", "s"), ("timestamp", ""), ("GPS Time", ""), ("t", ""), ("Timestamps", ""),
        ("TimeUS", "us"), ("iTOW", "ms"),
    ],
)  # fmt: skip
def test_a_clock_states_its_unit_at_an_end_of_its_name(name: str, unit: str) -> None:
    assert unit_of_name(name) == unit


@pytest.mark.parametrize(
    ("name", "per_second", "unit", "source"),
    [
        ("time_s", 1.0, "s", "name"), ("time", 1e3, "ms", "rate"), ("ms_today", 1e3, "ms", "name"),
        ("time", 1e9, "ns", "rate"),
    ],
)  # fmt: skip
def test_times_and_rates_are_in_seconds_whatever_the_unit(
    tmp_path: Path, name: str, per_second: float, unit: str, source: str
) -> None:
    """Drafts of descriptions select parts of the log by these times."""
    path = tmp_path / "log.csv"
    path.write_text(f"{name},speed\n" + "".join(f"{round(per_second * t, 1):g},{90 - 2 * t:.2f}\n" for t in TIME))
    clock = clock_of(path)
    assert (clock.info.unit, clock.info.unit_from) == (unit, source)
    assert clock.info.rate == pytest.approx(10.0)
    assert clock.info.span == pytest.approx((0.0, 19.9))
    assert clock.highest == pytest.approx(19.9 * per_second)


def test_a_long_table_states_its_unit_in_the_name_of_its_clock(tmp_path: Path) -> None:
    """Its rows are read in ms, and a description that says so is not contradicted."""
    path = tmp_path / "signals.csv"
    rows = "".join(f"{1000 * t:.0f},7,VSS,{90 - 2 * t:.2f}\n{1000 * t + 3:.0f},8,RPM,900\n" for t in TIME)
    path.write_text("timestamp_ms,id,signal_name,value\n" + rows)
    assert (clock_of(path).info.unit, clock_of(path).info.rate) == ("ms", pytest.approx(10.0))
    log = read_log(path, {"time": Column("timestamp_ms", "ms", "s"), "speed": Column("VSS", "km/h", "m/s")})
    assert log.time == pytest.approx(TIME)


def test_a_slow_clock_since_1970_counts_seconds() -> None:
    """Such as that of a weather station: in ms it would have a usual rate, but begin in 1970."""
    assert clock_units(0.1, 1.7e9) == ["s"]
    assert clock_units(5e-5, 1.2e9) == ["us"]  # of a controller that runs for 20 min
