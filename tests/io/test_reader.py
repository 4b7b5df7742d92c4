"""The contract of a reader: the channels of a file, and a log as recorded; checks and units are common to all."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from vdyn_cli.io.csv.csv_reader import CSV
from vdyn_cli.io.formats import log_formats
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.reader import ChannelInfo, Column, Reader, ReadOptions, channel_info
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log

TEXT = "Time [s],v [km/h],Gear\n" + "".join(f"{0.1 * i:.1f},{36 + (i % 7)},{'3' if i % 2 else ''}\n" for i in range(50))
MAPPING = {"time": Column("Time [s]", "s", "s"), "speed": Column("v [km/h]", "km/h", "m/s", sign=-1)}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "run.csv").write_text(TEXT)
    return tmp_path / "run.csv"


def test_csv_is_a_reader(path: Path) -> None:
    assert isinstance(CSV, Reader)
    assert CSV.matches(path)
    assert not CSV.matches(path.parent / "missing.csv")
    (path.parent / "run.mf4").write_bytes(b"MDF     4.10")
    assert not CSV.matches(path.parent / "run.mf4")


def test_channels_have_name_unit_rate_and_span(path: Path) -> None:
    time, speed, gear = CSV.channels(path)
    assert time == ChannelInfo("Time [s]", "s", pytest.approx(10.0), (0.0, pytest.approx(4.9)))
    assert (speed.name, speed.unit, speed.rate) == ("v [km/h]", "km/h", pytest.approx(10.0))
    assert (gear.unit, gear.rate, gear.span) == ("", pytest.approx(5.0), (pytest.approx(0.1), pytest.approx(4.9)))


def test_channels_without_a_clock_have_no_rate(path: Path) -> None:
    path.write_text("x [m];y [m]\n1;2\n2;3\n3;5\n")
    assert [(c.name, math.isnan(c.rate), math.isnan(c.span[0])) for c in CSV.channels(path)] == [
        ("x [m]", True, True),
        ("y [m]", True, True),
    ]


def test_a_reader_gives_the_log_as_written_and_read_log_gives_si(path: Path) -> None:
    written = CSV.read(path, MAPPING, ReadOptions(), "day/run.csv")
    assert written["speed"].tolist() == [36 + i % 7 for i in range(50)]
    assert written.place("speed") == "day/run.csv, column 'v [km/h]'"
    assert (written.line(0), written.line(3)) == (2, 5)
    log = read_log(path, MAPPING, name="day/run.csv")
    assert np.allclose(log["speed"], -written["speed"] / 3.6, rtol=1e-15)
    assert (log.name, log.source) == ("day/run.csv", None)


def test_clock_and_channel_problems_come_in_one_message(path: Path) -> None:
    path.write_text("t,v,w\n" + "".join(f"{0 if i == 30 else i},{i % 9},\n" for i in range(50)))
    mapping = {"time": Column("t", "s", "s"), "speed": Column("v", "m/s", "m/s"), "other": Column("w", "m/s", "m/s")}
    with pytest.raises(InputError) as error:
        read_log(path, mapping)
    assert "steps back" in str(error.value)
    assert "column 'w': is empty" in str(error.value)


class Swapped:
    """A test format: the file's name states its number of samples."""

    def matches(self, path: Path) -> bool:
        return path.suffix == ".count"

    def channels(self, path: Path) -> tuple[ChannelInfo, ...]:
        return ()

    def read(self, path: Path, mapping: Mapping[str, Column], options: ReadOptions, name: str) -> Log:
        time = np.arange(float(path.stem))
        return Log(name, time, {"speed": np.full(time.size, 36.0)})


def test_another_reader_is_checked_and_converted_as_csv_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(log_formats, "readers", lambda: ((Swapped(), CSV), ()))
    log = read_log(Path("500.count"), MAPPING)
    assert np.allclose(log["speed"], -10.0)
    (found,) = log.findings
    assert found.where == "500.count, speed"
    assert "is constant in the whole log" in found.what


def test_what_no_reader_matches_is_named(path: Path) -> None:
    (path.parent / "run.blf").write_bytes(b"LOGG\x90\0\0\0")
    with pytest.raises(InputError, match="is a trace of bus frames by Vector"):
        read_log(path.parent / "run.blf", MAPPING)


def test_a_row_that_is_written_twice_is_one_sample() -> None:
    time = np.arange(0.0, 10.05, 0.1)
    twice = channel_info("speed", "m/s", np.repeat(time, 2), np.repeat(np.sin(time), 2))
    assert twice.rate == pytest.approx(10.0)
