"""Variants of MATLAB and LabVIEW files, and of the contents of Parquet and MDF columns."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from vdyn_cli.io.channel_survey import survey
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.formats.lvm_reader import READER as LVM
from vdyn_cli.io.formats.mat_reader import READER as MAT
from vdyn_cli.io.formats.mdf_reader import READER as MDF
from vdyn_cli.io.reader import Column, ReadOptions
from vdyn_cli.quantities.errors import InputError

N = 200
TIME = np.arange(N) / 50.0
SPEED = 20.0 + np.sin(TIME)
FAST = np.arange(4 * N) / 200.0


def column(name: str, unit: str = "m/s", **where: str) -> Column:
    return Column(name, unit, "s" if unit == "s" else "m/s", **where)


@pytest.mark.parametrize(
    ("content", "time", "speed"),
    [
        ({"run": {"t": TIME, "v": SPEED}}, column("t", "s"), column("v")),
        ({"run": {"t": TIME, "v": SPEED}}, column("run.t", "s"), column("run.v")),
        ({"t": TIME[:, None], "run": {"v": SPEED[None, :]}}, column("t", "s"), column("v", group="run")),
        ({"data": np.column_stack([TIME, SPEED])}, column("data(:,1)", "s"), column("data(:,2)")),
        ({"tout": TIME, "out": {"signals": {"values": SPEED, "label": "v"}}}, column("tout", "s"), column("v")),
        (
            {"rec": {"X": {"Name": "Time", "Data": TIME}, "Y": [{"Name": "v", "Data": SPEED, "Unit": "m/s"}]}},
            column("Time", "s"),
            column("v"),
        ),
        ({"gps": {"t": TIME, "v": SPEED}, "can": {"t": FAST, "v": FAST}}, column("t", "s"), column("v", group="gps")),
    ],
)
def test_matlab_structs(content: dict[str, object], time: Column, speed: Column, tmp_path: Path) -> None:
    savemat(tmp_path / "run.mat", content)
    log = read_log(tmp_path / "run.mat", {"time": time, "speed": speed})
    assert np.array_equal(log.time, TIME)
    assert np.array_equal(log["speed"], SPEED)


def test_a_matlab_channel_without_a_clock_is_refused(tmp_path: Path) -> None:
    savemat(tmp_path / "run.mat", {"t": TIME, "v": FAST, "name": "text", "one": 1.0})
    assert next(iter(MAT.channels(tmp_path / "run.mat"))).span[0] == 0.0
    with pytest.raises(InputError, match=r"column 'v': has no clock: there is no column 't' for it"):
        read_log(tmp_path / "run.mat", {"time": column("t", "s"), "speed": column("v")})


HEADER = """LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t,
Multi_Headings\tYes
X_Columns\tNo
Time_Pref\tAbsolute
Date\t2026/05/04
Time\t09:30:00,5
***End_of_Header***\t
\t
"""
SEGMENT = """Channels\t2\t\t
Samples\t3\t3\t
Date\t2026/05/04\t2026/05/04\t
Time\t{time}\t{time}\t
Y_Unit_Label\tkm/h\tN m\t
X_Dimension\tTime\tTime\t
X0\t0,0000E+0\t0,0000E+0\t
Delta_X\t0,100000\t0,100000\t
***End_of_Header***\t\t\t
X_Value\tSpeed\tTorque\tComment
{rows}"""


def test_labview_segments_are_joined_by_their_start(tmp_path: Path) -> None:
    first = SEGMENT.format(time="09:30:01,0", rows="\t36,0\t1,5\tgo\n\t37,0\t2,5\t\n\t38,0\t3,5\t\n")
    second = SEGMENT.format(time="09:30:03,25", rows="\t40,0\t4,5\t\n\t41,0\t5,5\t\n\t42,0\t6,5\t\n")
    path = tmp_path / "run.lvm"
    path.write_text(HEADER + first + "\n" + second)
    time, speed, torque = LVM.channels(path)
    assert (time.name, speed.unit, torque.unit) == ("X_Value", "km/h", "N m")
    mapping = {"time": column("X_Value", "s"), "speed": column("Speed", "km/h")}
    log = read_log(path, mapping)
    assert np.allclose(log.time, [0.0, 0.1, 0.2, 2.25, 2.35, 2.45])
    assert np.allclose(log["speed"] * 3.6, [36, 37, 38, 40, 41, 42])
    written = LVM.read(path, mapping, ReadOptions(), "run")
    lines = path.read_text().splitlines()
    assert [lines[written.line(i) - 1].split("\t")[1] for i in range(6)] == [
        "36,0",
        "37,0",
        "38,0",
        "40,0",
        "41,0",
        "42,0",
    ]
    path.write_text(HEADER)
    with pytest.raises(InputError, match="the file is incomplete"):
        read_log(path, mapping)


def test_parquet_nulls_times_and_text(tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow", reason="pyarrow is not installed: pip install 'vdyn_cli[parquet]'")
    from pyarrow import parquet

    stamps = pa.array((np.arange(N) * 20_000_000 + 1_700_000_000_000_000_000).astype("datetime64[ns]"))
    speed = pa.array([None if i % 10 == 3 else float(v) for i, v in enumerate(SPEED)])
    table = pa.table({"timestamp": stamps, "v": speed, "gear": ["D"] * N, "on": [True] * N, "count": range(N)})
    parquet.write_table(table, tmp_path / "run.parquet", row_group_size=64)
    mapping = {"time": column("timestamp", "s"), "speed": column("v"), "count": column("count")}
    log = read_log(tmp_path / "run.parquet", mapping)
    assert np.allclose(log.time, TIME, atol=1e-12)
    assert np.array_equal(np.isnan(log["speed"]), np.arange(N) % 10 == 3)
    assert np.array_equal(log["count"], np.arange(N))
    with pytest.raises(InputError, match="column 'gear': contains no numbers"):
        read_log(tmp_path / "run.parquet", mapping | {"speed": column("gear")})


def test_mdf_conversions_invalid_samples_and_text(tmp_path: Path) -> None:
    asammdf = pytest.importorskip("asammdf", reason="asammdf is not installed: pip install 'vdyn_cli[mdf]'")
    raw = np.arange(N, dtype=np.int16)
    invalid = asammdf.InvalidationArray(raw % 10 == 3) if hasattr(asammdf, "InvalidationArray") else raw % 10 == 3
    scaled = asammdf.Signal(
        raw, TIME, unit="km/h", name="v", conversion={"a": 0.5, "b": 3.0}, invalidation_bits=invalid
    )
    gear = asammdf.Signal(
        raw % 2, TIME, name="gear", conversion={"val_0": 0, "text_0": b"N", "val_1": 1, "text_1": b"D"}
    )
    note = asammdf.Signal(np.array([b"ok"] * N), TIME, name="note", encoding="utf-8")
    file = asammdf.MDF(version="4.10")
    file.append([scaled, gear, note], acq_name="CAN")
    file.save(tmp_path / "run.mf4")
    file.close()
    mapping = {"time": column("time", "s"), "speed": column("v", "km/h"), "gear": column("gear")}
    log = read_log(tmp_path / "run.mf4", mapping)
    assert np.allclose(log["speed"][raw % 10 != 3] * 3.6, (0.5 * raw + 3.0)[raw % 10 != 3])
    assert np.isnan(log["speed"][raw % 10 == 3]).all()
    assert np.array_equal(log["gear"], raw % 2)
    with pytest.raises(InputError, match="column 'note': contains no numbers"):
        read_log(tmp_path / "run.mf4", mapping | {"speed": column("note")})


def test_an_empty_group_of_an_mdf_file_hides_no_channel(tmp_path: Path) -> None:
    asammdf = pytest.importorskip("asammdf", reason="asammdf is not installed: pip install 'vdyn_cli[mdf]'")
    none = np.empty(0)
    file = asammdf.MDF(version="4.10")
    file.append(
        [asammdf.Signal(none, none, unit="m/s", name="v"), asammdf.Signal(none, none, name="w")], acq_name="off"
    )
    file.append([asammdf.Signal(SPEED, TIME, unit="m/s", name="v")], acq_name="on")
    file.save(tmp_path / "run.mf4")
    file.close()
    assert [(c.name, c.group) for c in MDF.channels(tmp_path / "run.mf4")] == [
        ("w", "off"),
        ("time", "on"),
        ("v", "on"),
    ]
    mapping = {"time": column("time", "s"), "speed": column("v")}
    assert np.array_equal(read_log(tmp_path / "run.mf4", mapping)["speed"], SPEED)
    with pytest.raises(InputError, match=r"run\.mf4"):
        read_log(tmp_path / "run.mf4", mapping | {"speed": column("w")})


def test_tdms_waveforms_have_the_clock_of_their_properties(tmp_path: Path) -> None:
    """Two groups that start 0.5 s apart, timestamps, text, and a stale index of another recording beside the file."""
    nptdms = pytest.importorskip("nptdms", reason="pip install 'vdyn_cli[tdms]'")
    start, later = (np.datetime64(f"2026-05-04T09:30:00.{ms}", "us") for ms in ("250", "750"))
    fast = {"wf_start_time": start, "wf_increment": 0.005, "wf_start_offset": 0.1, "unit_string": "km/h"}
    slow = {"wf_start_time": later, "wf_increment": 0.02, "wf_start_offset": 0.0}
    stamps = start + (TIME * 1e6).astype("timedelta64[us]")
    path = tmp_path / "run.tdms"
    for objects in (
        [nptdms.ChannelObject("a", "other", TIME)],
        [
            nptdms.ChannelObject("a", "speed", 72.0 + FAST, fast),
            nptdms.ChannelObject("b", "slip speed", TIME, slow),
            nptdms.ChannelObject("c", "Timestamp", stamps),
            nptdms.ChannelObject("c", "gps speed", SPEED, slow),
            nptdms.ChannelObject("c", "note", ["ok"] * N),
        ],
    ):
        with nptdms.TdmsWriter(str(path), index_file=not path.exists()) as file:
            file.write_segment(objects)
    wanted = {"time": column("time", "s"), "speed": column("speed", "km/h")}
    log = read_log(path, wanted)
    assert np.allclose(log.time, 0.1 + FAST)
    assert np.allclose(log["speed"] * 3.6, 72.0 + FAST)
    assert log.begin == pytest.approx(datetime(2026, 5, 4, 9, 30, 0, 250_000, tzinfo=UTC).timestamp())
    assert np.allclose(read_log(path, {**wanted, "speed": column("slip speed")}).time, 0.5 + TIME)
    log = read_log(path, {"time": column("Timestamp", "s"), "speed": column("gps speed")})
    assert np.allclose(log.time, TIME, atol=2e-6)
    assert np.array_equal(log["speed"], SPEED)
    with pytest.raises(InputError, match="'note': contains no numbers"):
        read_log(path, {"time": column("Timestamp", "s"), "speed": column("note")})


@pytest.mark.parametrize("form", ["lines", "array", "in an object", "cut off"])
def test_json_objects_of_equal_keys_are_tables(form: str, tmp_path: Path) -> None:
    """Two tables of different rates whose written times count from one zero, below a head with other keys."""
    rows: list[dict[str, object]] = [{"type": "head", "wheel_m": 2.1}]
    rows += [
        {"ts": f"2026-01-29T19:43:{t:06.3f}Z", "motion": {"speed_kmh": v}} for t, v in zip(TIME, SPEED, strict=True)
    ]
    rows += [{"ts": f"2026-01-29T19:43:{0.5 + k:06.3f}Z", "alt": 12.0 + k, "gear": "D"} for k in range(20)]
    path = tmp_path / "ride.json"
    text = "\n".join(map(json.dumps, rows))
    contents = {"array": json.dumps(rows), "in an object": json.dumps({"app": "x", "samples": rows}), "lines": text}
    path.write_text(contents.get(form, text + '\n{"ts": "2026-01-29T19:4'))
    columns = {"time": column("ts", "s"), "speed": column("motion.speed_kmh", "km/h")}
    log = read_log(path, columns)
    assert np.allclose(log.time, TIME)
    assert np.allclose(log["speed"] * 3.6, SPEED)
    assert np.allclose(read_log(path, {**columns, "speed": column("alt")}).time, 0.5 + np.arange(20))


@pytest.mark.parametrize("form", ["arrays", "nested", "streams", "by row", "columns"])
def test_json_arrays_of_one_length_are_columns(form: str, tmp_path: Path) -> None:
    time, speed = TIME.tolist(), SPEED.tolist()
    arrays = {"time": time, "velocity": speed}
    contents: dict[str, object] = {
        "arrays": {"app": "x", **arrays, "laps": [1, 2]},
        "nested": {"meta": {"app": "x"}, "log": arrays},
        "streams": {**{n: {"data": v} for n, v in arrays.items()}, "latlng": {"data": [[48.0, 9.0]] * len(time)}},
        "by row": {n: {str(k): one for k, one in enumerate(v)} for n, v in arrays.items()},
        "columns": {"columns": list(arrays), "data": list(zip(time, speed, strict=True))},
    }
    path = tmp_path / "ride.json"
    path.write_text(json.dumps(contents[form]))
    log = read_log(path, {"time": column("time", "s"), "speed": column("velocity", "km/h")})
    assert np.allclose(log.time, TIME)
    assert np.allclose(log["speed"] * 3.6, SPEED)
    assert ("lng" in [f.column for f in survey(path)]) == (form == "streams")


def test_json_with_names_and_values_is_a_long_table(tmp_path: Path) -> None:
    rows = [
        {"name": n, "value": v, "timestamp": 1.4e9 + k / 10} for k in range(50) for n, v in (("v", k), ("gear", "D"))
    ]
    path = tmp_path / "trace.json"
    path.write_text("\n".join(map(json.dumps, rows)))
    log = read_log(path, {"time": column("timestamp", "s"), "speed": column("v")})
    assert np.allclose(log.time - 1.4e9, np.arange(50) / 10)
    assert np.allclose(log["speed"], np.arange(50))
