"""All formats give the same log as the CSV of the same numbers; damaged, wrong and unreadable files are reported."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.io.stored_logs import FORMATS, clean, write
from vdyn_cli.commands.contract_checks import outcomes, reader_checks
from vdyn_cli.description.spec_loading import load_spec
from vdyn_cli.io.formats.log_formats import read_log, readers
from vdyn_cli.io.reader import Browsable, Column, Reader, ReadOptions
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.steps import load_step

LOGS = ("coast_1", "bump_1", "drive_1", "slip_1", "tip_in", "wheel_1", "launch_1")
STEP_OF = {
    "coast": "coastdown",
    "bump": "bump",
    "drive": "validate",
    "slip": "tire",
    "tip": "shaft",
    "wheel": "inertia",
}


def reader_of(path: Path) -> Reader:
    return next(r for r in readers()[0] if r.matches(path))


def mapping_of(root: Path, log: str) -> dict[str, Column]:
    """The channels that the example description maps for a sample log."""
    step = load_step(STEP_OF.get(log.split("_")[0], "cg"))
    spec, _ = load_spec(root / "configs" / f"{step.name}.yaml", step.spec)
    return {n: Column(c.column, c.unit, step.channels()[n].unit, c.sign) for n, c in spec.channels.items()}


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("log", LOGS)
def test_every_format_reads_as_its_csv(kind: str, log: str, root: Path, tmp_path: Path) -> None:
    source = root / "sample_logs" / f"{log}.csv"
    mapping = mapping_of(root, log)
    expected = read_log(source, mapping)
    frame = pd.read_csv(source)
    units = {c: c[c.index("[") + 1 : c.index("]")] for c in frame.columns if "[" in c}
    path = write(kind, tmp_path / log, [{c: frame[c].to_numpy(dtype=float) for c in frame.columns}], units)
    clock = {"mf4": "time", "lvm": "X_Value"}.get(kind)
    columns = {
        n: Column(
            clock if n == "time" and clock else clean(c.column) if kind.startswith("mat") else c.column,
            c.unit,
            c.si_unit,
            c.sign,
        )
        for n, c in mapping.items()
    }
    found = read_log(path, columns)
    assert np.array_equal(found.time, expected.time)
    assert set(found.channels) == set(expected.channels)
    for name in found.channels:
        assert np.array_equal(found[name], expected[name], equal_nan=True), name


@pytest.mark.parametrize("kind", FORMATS)
def test_every_reader_keeps_its_contract(kind: str, tmp_path: Path) -> None:
    time = np.arange(200) / 50.0
    path = write(
        kind, tmp_path / "run", [{"time": time, "speed": 20.0 - time, "torque": np.sin(time)}], {"speed": "km/h"}
    )
    reader = reader_of(path)
    assert isinstance(reader, Browsable)
    assert not [outcome for outcome in outcomes(reader_checks(reader, path)) if outcome.wrong]
    infos = {c.name: c for c in reader.channels(path)}
    assert infos["speed"].rate == pytest.approx(50.0)
    assert infos["speed"].span == (0.0, pytest.approx(3.98))
    assert infos["speed"].unit == ("" if kind.startswith("mat") else "km/h")
    values = {r.info.name: r.values for r in reader.recordings(path)}
    assert np.allclose(values["torque"], np.sin(time))


TWO_CLOCKS = [
    {"time": np.arange(0.0, 60.0, 0.01), "speed": np.arange(0.0, 60.0, 0.01) ** 2 / 100.0},
    {"time": np.arange(0.003, 60.0, 0.1), "speed": np.full(600, 7.0), "height": np.arange(600.0)},
]


@pytest.mark.parametrize("kind", [k for k in FORMATS if k != "parquet"])
def test_channels_of_other_clocks_are_resampled_and_the_log_says_so(kind: str, tmp_path: Path) -> None:
    path = write(kind, tmp_path / "run", TWO_CLOCKS, {})
    time = "X_Value" if kind == "lvm" else "time"
    groups = {} if kind == "lvm" else {"group": "logger_1" if kind.startswith("mat") else "logger 1"}
    speed = Column("speed#1" if kind == "lvm" else "speed", "m/s", "m/s", **groups)
    mapping = {"time": Column(time, "s", "s"), "speed": speed, "height": Column("height", "m", "m")}
    reader = reader_of(path)
    written = reader.read(path, mapping, ReadOptions(), "run")
    assert set(written.channels) == {"speed"}
    (other,) = written.source.others  # type: ignore[union-attr]
    assert np.array_equal(other.time, TWO_CLOCKS[1]["time"])
    assert np.array_equal(other["height"], np.arange(600.0))
    log = read_log(path, mapping)
    assert np.array_equal(log.time, TWO_CLOCKS[0]["time"])
    assert np.isnan(log["height"][0])  # before its first sample
    inside = log.time >= 0.003
    assert np.allclose(log["height"][inside][:5000], (log.time[inside][:5000] - 0.003) / 0.1)
    (found,) = [f for f in log.findings if "resampled" in f.what]
    assert found.what == "resampled to the sampling times of 'speed': 'height' (linear interpolation)"


def test_the_group_of_time_chooses_the_clock(tmp_path: Path) -> None:
    path = write("mf4", tmp_path / "run", TWO_CLOCKS, {})
    mapping = {
        "time": Column("time", "s", "s", group="logger 2"),
        "speed": Column("speed", "m/s", "m/s", group="logger 1"),
        "height": Column("height", "m", "m"),
    }
    log = read_log(path, mapping)
    assert np.array_equal(log.time, TWO_CLOCKS[1]["time"])
    (found,) = [f for f in log.findings if "resampled" in f.what]
    assert "of 'height': 'speed' (means over 0.1 s)" in found.what


def test_a_name_in_two_groups_is_refused_with_the_groups(tmp_path: Path) -> None:
    path = write("mf4", tmp_path / "run", TWO_CLOCKS, {})
    mapping = {"time": Column("time", "s", "s"), "speed": Column("speed", "m/s", "m/s")}
    with pytest.raises(InputError, match="add group: 'logger 1' or 'logger 2'"):
        read_log(path, mapping)
    mapping["speed"] = Column("speed", "m/s", "m/s", group="logger 3")
    with pytest.raises(InputError, match="its group is 'logger 1' or 'logger 2'"):
        read_log(path, mapping)


@pytest.mark.parametrize("kind", ["mf4", "parquet", "lvm", "tdms"])
def test_the_unit_of_the_file_is_checked(kind: str, tmp_path: Path) -> None:
    time = np.arange(100) / 50.0
    path = write(kind, tmp_path / "run", [{"time": time, "speed": 20.0 - time}], {"speed": "km/h"})
    clock = {"lvm": "X_Value"}.get(kind, "time")
    log = read_log(path, {"time": Column(clock, "s", "s"), "speed": Column("speed", "m/s", "m/s")})
    (found,) = [f for f in log.findings if f.doubt]
    assert "the file states another unit 'km/h'" in found.what
    good = read_log(path, {"time": Column(clock, "s", "s"), "speed": Column("speed", "km/h", "m/s")})
    assert not [f for f in good.findings if f.doubt]


@pytest.mark.parametrize(
    ("kind", "library", "extra"),
    [
        ("mf4", "asammdf", "mdf"),
        ("parquet", "pyarrow", "parquet"),
        ("mat73", "h5py", "mat"),
        ("tdms", "nptdms", "tdms"),
    ],
)
def test_a_missing_library_is_named_with_its_command(
    kind: str, library: str, extra: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mat73 = b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF"
    head = {"mf4": b"MDF     4.10", "parquet": b"PAR1", "mat73": mat73, "tdms": b"TDSm"}[kind]
    path = tmp_path / "run.bin"
    path.write_bytes(head)
    for name in (library, f"{library}.parquet"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(InputError, match=rf"pip install 'vdyn_cli\[{extra}\]'") as error:
        read_log(path, {"time": Column("time", "s", "s")})
    assert library in str(error.value).lower()


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("keep", [0.02, 0.3, 0.7, 0.97])
def test_a_file_that_is_cut_off_is_named_or_read_as_far_as_it_goes(kind: str, keep: float, tmp_path: Path) -> None:
    time = np.arange(5000) / 50.0
    path = write(kind, tmp_path / "run", [{"time": time, "speed": 20.0 + np.sin(time)}], {})
    content = path.read_bytes()
    path.write_bytes(content[: int(keep * len(content))])
    clock = {"lvm": "X_Value"}.get(kind, "time")
    mapping = {"time": Column(clock, "s", "s"), "speed": Column("speed", "m/s", "m/s")}
    try:
        log = read_log(path, mapping)
    except InputError:
        with pytest.raises(InputError, match=path.name):
            read_log(path, mapping)
        return
    n = log.time.size - 1 if kind == "lvm" else log.time.size  # the last line of a text may be cut within a number
    assert np.array_equal(log.time[:n], time[:n])
    assert np.array_equal(log["speed"][:n], (20.0 + np.sin(time))[:n])


def test_options_of_text_logs_are_refused_elsewhere(tmp_path: Path) -> None:
    time = np.arange(100) / 50.0
    path = write("mat", tmp_path / "run", [{"time": time, "speed": 20.0 - time}], {})
    with pytest.raises(InputError, match="applies to text logs only"):
        read_log(
            path, {"time": Column("time", "s", "s"), "speed": Column("speed", "m/s", "m/s")}, ReadOptions(decimal=",")
        )
