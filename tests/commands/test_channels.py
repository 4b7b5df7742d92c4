"""``vdyn channels``: every channel of a log of any format, as a table and as JSON."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.io.stored_logs import FORMATS, write
from tests.result_check import validator
from vdyn_cli.commands.run_channels import channels_json, channels_table
from vdyn_cli.quantities.errors import InputError, raise_all

TIME = np.arange(3000) / 50.0
SPEED = 20.0 - 0.1 * TIME + 0.01 * np.sin(1000.0 * TIME)
FROZEN = np.where((TIME > 20.0) & (TIME < 45.0), SPEED[1001], SPEED)
TABLE = {
    "time": TIME,
    "speed": SPEED,
    "copy": SPEED,
    "frozen": FROZEN,
    "flat": np.full(3000, 7.5),
    "none": TIME * np.nan,
}


def shown(*paths: Path) -> str:
    text, problems = channels_table(*paths)
    raise_all(problems)
    return text


def entries(path: Path) -> dict[str, dict[str, object]]:
    document = json.loads(channels_json(path))
    validator("channels").validate(document)
    return {c["column"]: c for c in document["channels"]}


@pytest.mark.parametrize("kind", FORMATS)
def test_every_format_says_what_it_holds(kind: str, tmp_path: Path) -> None:
    table = {k: v for k, v in TABLE.items() if kind != "lvm" or k != "none"}  # LabVIEW writes no empty channel
    path = write(kind, tmp_path / "run", [table], {"speed": "km/h"})
    found = entries(path)
    states = dict(zip(TABLE, ("clock", "varies", "varies", "varies", "constant", "empty"), strict=True))
    clock = "X_Value" if kind == "lvm" else "time"
    assert {n: c["state"] for n, c in found.items()} == {clock if n == "time" else n: states[n] for n in table}
    assert found["speed"]["rate"] == pytest.approx(50.0)
    assert found["speed"]["span"] == [0.0, pytest.approx(59.98)]
    pair = sorted(("speed", "copy"), key=list(found).index)
    assert found[pair[1]]["same_as"] == ("logger 1." if kind in ("mf4", "tdms") else "") + pair[0]
    assert found["frozen"]["rest"][:2] == [pytest.approx(20.02), pytest.approx(44.98)]  # type: ignore[index]
    assert found["flat"]["lowest"] == 7.5
    assert "constant at" in shown(path)


def test_names_that_are_repeated_are_shown_as_a_description_writes_them(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("t [s];v [m/s];v [m/s];gear\n" + "".join(f"{i};{i % 7};{i % 5};D\n" for i in range(3000)))
    found = entries(path)
    assert list(found) == ["t [s]", "v [m/s]#1", "v [m/s]#2", "gear"]
    assert (found["v [m/s]#2"]["repeated"], found["v [m/s]#2"]["unit"]) == (2, "m/s")
    assert found["gear"]["state"] == "text"
    assert "one of 2 of this name" in shown(path)


def test_several_logs_say_what_differs(tmp_path: Path) -> None:
    paths = [
        write("mat", tmp_path / f"run_{k}", [table], {"speed": unit})
        for k, (table, unit) in enumerate(
            [(TABLE, "km/h"), (TABLE, "km/h"), ({"time": 2.0 * TIME, "speed": SPEED, "yaw": FROZEN}, "m/s")]
        )
    ]
    lines = shown(*paths).splitlines()
    differences = [line.strip() for line in lines if line.startswith("    against")]
    assert differences[0].endswith("the same columns and units")
    for said in ("lacks 'copy', ", "adds 'yaw'", "instead of", "clock of 25 Hz instead of 50 Hz"):
        assert said in differences[1]
    assert [d["log"] for d in json.loads(channels_json(*paths))] == [p.name for p in paths]


def test_the_log_of_another_logger_has_its_own_table(tmp_path: Path) -> None:
    paths = [tmp_path / f"{name}.csv" for name in ("can_1", "gps_1", "can_2", "gps_2")]
    for path in paths:
        names = "t [s],rpm [1/min],dlc" if path.stem.startswith("can") else "t [s],v [m/s],dlc"
        path.write_text(names + "\n" + "".join(f"{i},{i % 7},8\n" for i in range(100)))
    text = shown(*paths)
    assert text.count("channel  ") == 2
    assert "    against can_1.csv: the same columns" in text
    assert "    against gps_1.csv: the same columns" in text


def test_a_log_is_compared_with_the_most_similar_one_before_it(tmp_path: Path) -> None:
    for name, header in (("a", "t,v,p,q"), ("b", "t,v,p,q,r,s"), ("c", "t,v,p,q,r,s")):
        rows = np.column_stack([TIME, *(SPEED + k for k in range(header.count(",")))])
        np.savetxt(tmp_path / f"{name}.csv", rows, delimiter=",", header=header, comments="")
    text = shown(*(tmp_path / f"{name}.csv" for name in "abc"))
    assert "against a.csv: adds 'r', 's'" in text
    assert "against b.csv: the same columns and units" in text


def test_one_log_that_cannot_be_read_hides_no_other(tmp_path: Path) -> None:
    paths = [tmp_path / f"run_{k}.csv" for k in range(3)]
    for path in paths:
        path.write_text("t [s],v [m/s]\n" + "".join(f"{i},{i % 7}\n" for i in range(100)))
    paths[0].write_text("t [s],v [m/s]\n")
    text, problems = channels_table(*paths)
    assert "v [m/s]" in text
    assert "run_2.csv: 2 channels" in text
    assert [(p.where, p.what) for p in problems] == [("run_0.csv", "has no rows of data")]


def test_logs_of_one_name_are_reported_with_their_folders(tmp_path: Path) -> None:
    paths = [tmp_path / f"run_{k}" / "Location.csv" for k in range(3)]
    for path in paths:
        path.parent.mkdir()
        path.write_text("t [s],v [m/s]\n" + "".join(f"{i},{i % 7}\n" for i in range(100)))
    paths[2].write_text("t [s],v [m/s]\n")
    text, problems = channels_table(*paths)
    assert "run_1/Location.csv: 2 channels\n    against run_0/Location.csv: the same" in text
    assert [p.where for p in problems] == ["run_2/Location.csv"]


def test_a_description_among_the_logs_is_reported_as_such(tmp_path: Path) -> None:
    path = tmp_path / "coast.yaml"
    path.write_text("test: coastdown\n")
    assert [p.what for p in channels_table(path)[1]] == ["is a description, not a log"]


def test_a_table_without_a_clock_says_so(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("x [m];y [m]\n1;2\n2;3\n3;5\n")
    assert "No column increases like a clock" in shown(path)
    assert entries(path)["x [m]"]["rate"] is None


def test_a_damaged_clock_is_named(tmp_path: Path) -> None:
    path = tmp_path / "lap.csv"
    path.write_text("Time,speed\n1762640265216,50\n1762640003072,51\n1762640265216,52\n")
    assert "Column 'Time' has the name of a clock, but its values do not increase" in shown(path)


def test_raw_bus_frames_in_a_table_are_reported_as_such(tmp_path: Path) -> None:
    path = tmp_path / "bus.csv"
    path.write_text("timestamp,can_id,data\n0.1,0x18FEF100,00F2F9CC\n0.2,0x0CF00400,14880000\n")
    (problem,) = channels_table(path)[1]
    assert "is a trace of bus frames" in problem.what
    assert "DBC" in problem.remedy


# Facts on every file of the measurements: clock, number of channels, of these text; None: the file has no table.
KNOWN: dict[str, tuple[str, int, int] | None] = {
    "comma2k19_segment/can_speed.csv": ("t", 2, 0),
    "comma2k19_segment/gnss.csv": ("t", 7, 0),
    "comma2k19_segment/imu_acc_mps2.csv": ("t", 4, 0),
    "comma2k19_segment/imu_gyro_radps.csv": ("t", 4, 0),
    "comma2k19_segment/wheel_speed_mps.csv": ("t", 5, 0),
    "epa_testcar/testcar_2012_2016_subset.csv": ("", 14, 4),
    "pendulum_bicycle/bicycle-wheel-axial-inertia-rate-gyro-measurement.csv": ("time", 2, 0),
    "pendulum_bicycle/bicycle-wheel-radial-inertia-rate-gyro-measurement.csv": ("time", 2, 0),
    "pendulum_bicycle/wheels_compound_pendulum.csv": ("", 8, 2),
    **{f"pendulum_bicycle/{name}Benchmark.txt": None for name in ("Browser", "Fisher", "Pista", "Rigid")},
    **{f"pendulum_bicycle/{name}Measured.txt": None for name in ("Browser", "Fisher", "Pista", "Rigid")},
}


@pytest.mark.slow  # reads some thirty files
def test_every_file_of_the_measurements_is_described_or_refused(shared_data: Path) -> None:
    paths = [p for p in sorted(shared_data.glob("*/*")) if p.suffix in (".csv", ".gz", ".txt", ".xlsx")]
    assert len(paths) > 20
    for path in paths:
        name = f"{path.parent.name}/{path.name}"
        known = KNOWN.get(name, None if path.suffix == ".xlsx" else ("Time [s]", 0, 0))
        if known is None:
            with pytest.raises(InputError):
                shown(path)
            continue
        found = entries(path)
        assert [n for n, c in found.items() if c["state"] == "clock"] == [n for n in known[:1] if n], name
        assert sum(c["state"] == "text" for c in found.values()) == known[2], name
        assert len(found) == known[1] or (known[1] == 0 and len(found) > 20), name
        if name.startswith("bmw_i3"):
            assert found["Velocity [km/h]"]["rate"] == pytest.approx(10.0, abs=0.01)
            stands = "are constant together" in shown(path)
            assert stands == (path.name == "TripB34.csv.gz"), name


def test_a_logger_that_paused_or_stopped_is_reported(tmp_path: Path) -> None:
    time = np.arange(0.0, 300.0, 0.1)
    columns = [20.0 - 10.0 * np.cos(time / 15.0), 900.0 + 40.0 * np.sin(time / 7.0), 300.0 * np.sin(time / 5.0)]
    held = np.where((time > 150.0) & (time < 162.0), np.searchsorted(time, 150.0), np.arange(time.size))
    held[time > 250.0] = np.searchsorted(time, 250.0)  # a car that parks does not jump
    stored = np.where(time > 80.0, time + 7.5, time)
    table = {"time [s]": stored, **{name: x[held] for name, x in zip(("v", "p", "M"), columns, strict=True)}}
    rows = [",".join(table), *(",".join(f"{x:.4f}" for x in row) for row in zip(*table.values(), strict=True))]
    (tmp_path / "drive.csv").write_text("\n".join(rows))
    text = shown(tmp_path / "drive.csv")
    assert "clock; gap from 80.000 s to 87.600 s" in text
    assert "All channels repeat their values from 157.5 s to 169.4 s, then jump." in text
    clock = entries(tmp_path / "drive.csv")["time [s]"]
    assert clock["gaps"] == [1, 80.0, 87.6]
    assert clock["stalls"] == [[pytest.approx(157.5), pytest.approx(169.5, abs=0.11)]]


def test_gaps_and_constant_segments_of_a_further_log_are_stated(tmp_path: Path) -> None:
    rows = [f"{0.1 * k:.1f},{80.0 - 0.05 * k:.2f}" for k in range(1000)]
    held = [f"{0.1 * k:.1f},{80.0 - 0.05 * (k if not 400 <= k < 700 else 400):.2f}" for k in range(1000)]
    paths = [tmp_path / f"{name}.csv" for name in ("whole", "gap", "held")]
    for path, lines in zip(paths, (rows, rows[:300] + rows[700:], held), strict=True):
        path.write_text("\n".join(["Time [s],Speed [km/h]", *lines]))
    text, _ = channels_table(*paths)
    assert "against whole.csv: 'Time [s]': gap from 29.90 s to 70.00 s\n" in text
    assert "against whole.csv: 'Speed [km/h]': constant at 60 from 40.0 s to 69.9 s (30 %)" in text


def test_a_clock_of_full_seconds_is_reported_and_a_finer_one_preferred(tmp_path: Path) -> None:
    lines = [f"{k // 10},{60 - k / 10:.1f},{1.6e9 + k / 10:.1f}" for k in range(300)]
    (tmp_path / "log.csv").write_text("\n".join(["Runtime [s],Speed [km/h],epoch time", *lines]))
    (tmp_path / "coarse.csv").write_text("\n".join(one[: one.rindex(",")] for one in ("Time [s],v,", *lines)))
    assert entries(tmp_path / "log.csv")["epoch time"]["state"] == "clock"
    assert "clock; too few digits: 270 rows share the time of the one before" in shown(tmp_path / "coarse.csv")


def test_a_car_that_starts_from_rest_is_no_stopped_logger(tmp_path: Path) -> None:
    time = np.arange(0.0, 30.0, 0.1)
    acceleration = np.where(time > 8.0, 2.5 - 0.05 * time, 0.0)
    speed = np.cumsum(0.1 * acceleration)
    rows = [f"{t:.1f},{v:.4f},{a:.4f},{40.0 * v:.2f}" for t, v, a in zip(time, speed, acceleration, strict=True)]
    (tmp_path / "start.csv").write_text("\n".join(["Time [s],v,a,rpm", *rows]))
    assert "jump" not in shown(tmp_path / "start.csv")


def test_a_unit_at_the_end_of_a_name_is_shown(tmp_path: Path) -> None:
    rows = "".join(f"{k / 10:.1f},{60 - k / 10:.1f}\n" for k in range(60))
    (tmp_path / "log.csv").write_text("tGPS_s,vGPS_mph\n" + rows)
    lines = shown(tmp_path / "log.csv").splitlines()
    assert lines[1].split()[:4] == ["tGPS_s", "s", "10", "Hz"]
    assert lines[2].split()[:2] == ["vGPS_mph", "mph"]
    assert lines[2].endswith("unit by the end of its name")
