"""``vdyn init`` with logs of several loggers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from tests.commands.drafts import WAVE, columns, draft, table


def log_name(names: str, logger: str, run: int) -> str:
    """The name of a log; ``other`` counts downwards on the car's bus."""
    return names.format(logger=logger, run=run, letter="abcd"[run - 1], other=7 - run if logger == "can" else run)


def write_loggers(folder: Path, begins: Sequence[float], names: str) -> list[Path]:
    """Four coast-downs, each by the car's bus and by a receiver with a heading; all clocks count from ``begins``."""
    paths = []
    for run, begin in enumerate(begins, 1):
        time = np.arange(0.0, 60.0, 0.1)
        speed = 72.0 - 0.7 * time
        heading = 30.0 if run % 2 else 210.0
        tables = {
            "can": {"Time [s]": time + begin, "Vehicle Speed [km/h]": speed},
            "vbox3": {"t [s]": time + begin + 3.0, "GPS Speed [km/h]": speed, "Heading [deg]": heading + 0.0 * time},
        }
        for logger, channels in tables.items():
            path = folder / log_name(names, logger, run)
            np.savetxt(path, np.column_stack([*channels.values()]), "%.3f", ",", header=",".join(channels), comments="")
            paths.append(path)
    return sorted(paths)


@pytest.mark.parametrize(
    ("begins", "names"),
    [
        ((0.0, 0.0, 0.0, 0.0), "{logger}_run{run}_2026.csv"),
        ((0.0, 0.0, 0.0, 0.0), "{logger}_{letter}.csv"),
        ((1.7e9, 1.7e9 + 200.0, 1.7e9 + 400.0, 1.7e9 + 600.0), "{logger}_{other}.csv"),
    ],
)
def test_each_run_has_a_log_of_each_logger(tmp_path: Path, begins: Sequence[float], names: str) -> None:
    found, description = draft("coastdown", *write_loggers(tmp_path, begins, names))
    assert [columns(one["channels"])["speed"][0] for one in description["loggers"]] == [
        "Vehicle Speed [km/h]",
        "GPS Speed [km/h]",
    ]
    pairs = sorted(tuple(Path(log).name for log in run["logs"]) for run in description["runs"])
    wanted = [(log_name(names, "can", run), log_name(names, "vbox3", run)) for run in (1, 2, 3, 4)]
    assert pairs == sorted(wanted)
    ways = {Path(run["logs"][1]).name: run["direction"] for run in description["runs"]}
    by_run = [ways[pair[1]] for pair in wanted]
    assert by_run in (["out", "back"] * 2, ["back", "out"] * 2)  # out is that of the first in the order of the names
    starts = [run.get("start") for run in description["runs"]]
    assert [one is not None for one in starts] == [begins[0] > 0.0] * 4  # only clocks that count from an epoch tell it
    assert not any("direction" in key for key in found.undecided)


def test_files_of_one_folder_are_of_one_run(tmp_path: Path) -> None:
    """A phone's app writes a folder for each recording, with a file of the same name for each sensor."""
    paths = []
    for path in write_loggers(tmp_path, (0.0,) * 4, "{logger}_run{run}.csv"):
        logger, run = path.stem.split("_")
        (tmp_path / f"recording {run}").mkdir(exist_ok=True)
        paths.append(path.rename(tmp_path / f"recording {run}" / f"{logger}.csv"))
    runs = draft("coastdown", *paths)[1]["runs"]
    assert len(runs) == 4
    assert all(len({Path(log).parent for log in run["logs"]}) == 1 == len(run["logs"]) - 1 for run in runs)


@pytest.mark.parametrize("lost", ["can_run2.csv", "vbox3_run4.csv"])
def test_a_log_without_the_other_logger_s_is_left_out(tmp_path: Path, lost: str) -> None:
    paths = [p for p in write_loggers(tmp_path, (0.0,) * 4, "{logger}_run{run}.csv") if p.name != lost]
    found, description = draft("coastdown", *paths)
    pairs = {tuple(Path(log).name for log in run["logs"]) for run in description["runs"]}
    lone = lost.replace("can", "vbox3") if lost.startswith("can") else lost.replace("vbox3", "can")
    runs = [k for k in (1, 2, 3, 4) if str(k) not in lost.replace("vbox3", "")]
    assert pairs == {(f"can_run{k}.csv", f"vbox3_run{k}.csv") for k in runs}
    assert re.search(rf'{lone}"}}  # left out: no matching log of the other logger', found.text)


def test_a_log_in_another_unit_is_a_run_with_keys_of_its_own(tmp_path: Path) -> None:
    for k in range(4):
        unit, factor = ("mph", 1 / 1.609344) if k == 2 else ("km/h", 1.0)
        rows = [f"{t:.1f},{factor * (72.0 + k - 0.7 * t):.3f}" for t in np.arange(0.0, 60.0, 0.1)]
        (tmp_path / f"run_{k}.csv").write_text("\n".join([f"t [s],Speed [{unit}]", *rows]) + "\n")
    runs = draft("coastdown", *sorted(tmp_path.glob("*.csv")))[1]["runs"]
    assert [run.get("units") for run in runs] == [None, None, {"speed": "mph"}, None]
    assert runs[2]["columns"] == {"speed": "Speed [mph]"}


@pytest.mark.parametrize("both", [False, True])
def test_a_log_in_another_unit_belongs_to_its_logger_s_others(tmp_path: Path, both: bool) -> None:
    """Its run states the unit for that logger only; without a channel of the other logger there is one logger."""
    paths = write_loggers(tmp_path, (0.0,) * 4, "{logger}_run{run}.csv")
    for k, path in enumerate(paths):
        head, *rows = path.read_text().splitlines()
        head = head if both or "can" in path.name else head.replace("GPS Speed", "Lateral Speed Left")
        cut = rows[: len(rows) - k]  # equal logs are one recording
        path.write_text("\n".join([head, *cut]) + "\n")
    odd = tmp_path / "can_run3.csv"
    lines = odd.read_text().splitlines()
    rows = [f"{t},{float(v) / 3.6:.4f}" for t, v in (line.split(",") for line in lines[1:])]
    odd.write_text("\n".join([lines[0].replace("km/h", "m/s"), *rows]) + "\n")
    found, description = draft("coastdown", *paths)
    units = {Path(run["logs"][0] if both else run["log"]).name: run.get("units") for run in description["runs"]}
    assert units.pop("can_run3.csv") == ([{"speed": "m/s"}, None] if both else {"speed": "m/s"})
    assert list(units.values()) == [None] * 3
    assert 'can_run3.csv"}  # left out' not in found.text


def test_logs_of_two_loggers_that_cannot_be_matched_are_not(tmp_path: Path) -> None:
    found, description = draft("coastdown", *write_loggers(tmp_path, (0.0,) * 4, "{logger}_{other}.csv"))
    assert "loggers" not in description
    assert "neither their clocks nor their names show" in found.text


def test_a_logger_without_a_speed_is_aligned_by_a_wheel_s_speed(tmp_path: Path) -> None:
    """The acceleration of a steady coast-down matches that of the speed at no delay."""
    paths = []
    for path in write_loggers(tmp_path, (0.0,) * 4, "{logger}_run{run}.csv"):
        header, *rows = path.read_text().splitlines()
        if "can" in path.name:
            header = "Time [s],nRad_HL [1/min],aLaengs [g]"
            rows = [f"{t},{9.0 * float(v):.2f},{-0.02 + 0.001 * (k % 7):.3f}" for k, row in enumerate(rows) for t, v in
                    [row.split(",")]]  # fmt: skip
            path.write_text("\n".join([header, *rows]))
        paths.append(path)
    found, description = draft("coastdown", *paths)
    bus = next(one["channels"] for one in description["loggers"] if "acceleration" in one["channels"])
    assert bus["wheel_speed"] == {"column": "nRad_HL [1/min]", "unit": "1/min"}
    assert "aligned by channels 'speed' and 'wheel_speed'" in found.text


def test_the_columns_that_may_be_a_needed_channel_are_named(tmp_path: Path) -> None:
    """A torque at the hubs is that of the drive only where no brake is between."""
    time = np.arange(600) / 10.0
    gps = table(tmp_path / "gps.csv", Time_s=time, Speed_mpers=20 + WAVE)
    can = table(tmp_path / "can.csv", Time_s=time, **{"n_HL_rpm": 600 + 30 * WAVE, "M_Nabe_HL_N m": 50 * WAVE})
    found, description = draft("validate", gps, can)
    assert set(description["loggers"][1]["channels"]) == {"time", "wheel_speed_rl"}
    what = "drive_torque, or drive_torque_left with drive_torque_right: needed, but not found in any of the logs"
    assert f'# {what}; by their unit: "M_Nabe_HL [N m]"\n' in found.text


def test_the_torque_s_logger_sets_the_clock(tmp_path: Path) -> None:
    time = np.arange(0.0, 60.0, 0.1)
    for run in (1, 2):
        table(tmp_path / f"gps_{run}.csv", t_s=time, **{"GPS Speed_km/h": 40.0 + WAVE})
        table(tmp_path / f"can_{run}.csv", t_s=time, **{"Motor Torque_Nm": WAVE, "Wheel Speed FL_rpm": 300.0 + WAVE})
    found, description = draft("validate", *sorted(tmp_path.glob("*.csv"), reverse=True))  # the receiver first
    assert ["drive_torque" in one["channels"] for one in description["loggers"]] == [True, False]
    assert [run["logs"][0][:3] for run in description["runs"]] == ["can", "can"]
    assert "aligned by channels 'speed' and 'wheel_speed_fl'" in found.text


def test_a_logger_without_a_channel_of_the_step_leaves_the_others_logs_as_runs(tmp_path: Path) -> None:
    """A phone's folder has a file for each sensor, of which the gyroscope's is of no use in a coast-down."""
    time, paths = np.arange(600) * 0.2, []
    for k in range(2):
        (folder := tmp_path / f"ride_{k}").mkdir()
        paths.append(table(folder / "Location.csv", Time_s=time, Speed_kmperh=90.0 + k - 0.1 * np.arange(600)))
        paths.append(table(folder / "Gyroscope.csv", Time_s=time, z_=np.sin(time)))
    found, description = draft("coastdown", *paths)
    assert "loggers" not in description
    assert [Path(run["log"]).name for run in description["runs"]] == ["Location.csv"] * 2
    assert found.text.count("# left out: no speed: no column has such a name") == 2
