"""Tables of split times are read as the instants that they state, without samples in between."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.commands.drafts import draft
from tests.io.stored_logs import write
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.formats.split_times import SplitTable, split_table
from vdyn_cli.io.reader import Column, ReadOptions, Recorded, channel_info
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.steps import load_step

MAPPING = {"time": Column("t1", "s", "s"), "speed": Column("v [km/h]", "km/h", "m/s")}
LEVELS = [100.0, 90.0, 80.0, 70.0, 60.0]
ELAPSED = [0.0, 4.2, 9.1, 14.9, 21.7]


def table(folder: Path, speeds: list[float], times: list[str]) -> Path:
    rows = [f"{v};{t}" for v, t in zip(speeds, times, strict=True)]
    (folder / "splits.csv").write_text("\n".join(["v [km/h];t1", *rows]) + "\n")
    return folder / "splits.csv"


@pytest.mark.parametrize(
    ("how", "speeds", "times"),
    [
        ("elapsed", LEVELS, ["0", "4.2", "9.1", "14.9", "21.7"]),
        ("elapsed", LEVELS[::-1], ["21.7", "14.9", "9.1", "4.2", "0"]),
        ("elapsed", [110.0, *LEVELS], ["", "0", "4.2", "9.1", "14.9", "21.7"]),
        ("intervals", LEVELS, ["", "4.2", "4.9", "5.8", "6.8"]),
        ("intervals", LEVELS, ["0", "4.2", "4.9", "5.8", "6.8"]),
        ("intervals", [110.0, *LEVELS, 50.0], ["", "", "4.2", "4.9", "5.8", "6.8", ""]),
    ],
)
def test_the_instants_are_those_of_the_table(how: str, speeds: list[float], times: list[str], tmp_path: Path) -> None:
    log = read_log(table(tmp_path, speeds, times), MAPPING, ReadOptions(split_times=how))  # type: ignore[arg-type]
    assert np.allclose(log.time, ELAPSED, rtol=1e-12)
    assert np.allclose(log["speed"] * 3.6, LEVELS, rtol=1e-12)


def test_a_missing_interval_is_a_problem(tmp_path: Path) -> None:
    path = table(tmp_path, LEVELS, ["", "4.2", "", "5.8", "6.8"])
    with pytest.raises(InputError, match="an interval is missing in row 3"):
        read_log(path, MAPPING, ReadOptions(split_times="intervals"))


def test_tables_in_other_formats(tmp_path: Path) -> None:
    path = write("mat", tmp_path / "splits", [{"v": np.array(LEVELS[::-1]), "t1": np.array(ELAPSED[::-1])}], {})
    log = read_log(
        path, MAPPING | {"speed": Column("v", "km/h", "m/s")}, ReadOptions(split_times="elapsed"), "splits.mat"
    )
    assert np.allclose(log.time, ELAPSED)
    assert np.allclose(log["speed"] * 3.6, LEVELS)


def test_runs_of_one_table_have_columns_of_their_own(tmp_path: Path) -> None:
    rows = [f"{v},{t},{t + 0.1 * i}" for i, (v, t) in enumerate(zip(LEVELS, ELAPSED, strict=True))]
    (tmp_path / "splits.csv").write_text("\n".join(["speed_kmh,t1,t2", *rows]) + "\n")
    text = """
        test: coastdown
        vehicle: {mass: 1500 kg, frontal_area: 2.2 m^2}
        environment: {temperature: 20 degC, pressure: 1 bar}
        reading: {split_times: elapsed}
        channels: {time: {column: t1, unit: s}, speed: {column: speed_kmh, unit: km/h}}
        runs:
          - {log: splits.csv, direction: out}
          - {log: splits.csv, direction: back, columns: {time: t2}}
    """
    (tmp_path / "splits.yaml").write_text(text.replace("\n        ", "\n"))
    first, second = gather(load_step("coastdown"), tmp_path / "splits.yaml").logs
    assert first.time.tolist() == ELAPSED
    assert np.allclose(second.time - first.time, [0.0, 0.1, 0.2, 0.3, 0.4])
    assert second.name == "splits.csv (t2)"
    (tmp_path / "splits.yaml").write_text(
        (tmp_path / "splits.yaml").read_text().replace("{time: t2}", "{position: t2}")
    )
    with pytest.raises(InputError, match="channel 'position' is not mapped"):
        gather(load_step("coastdown"), tmp_path / "splits.yaml")


@pytest.mark.parametrize(
    "text",
    [
        "Run;100;90;80\n1;0;4.2;9.1\n2;0;4,3;9,3\n",
        "made by X\n\nRun,dir,100 km/h,90 km/h,80 km/h\n1,out,0,4.2,9.1\n2,back,0,4.3,9.3\n",
    ],
)
def test_a_table_with_a_row_for_each_run_is_turned(text: str, tmp_path: Path) -> None:
    (tmp_path / "splits.csv").write_text(text)
    mapping = {"time": Column("2", "s", "s"), "speed": Column("Run", "km/h", "m/s")}
    log = read_log(tmp_path / "splits.csv", mapping, ReadOptions(split_times="elapsed", split_runs="rows"))
    np.testing.assert_allclose(log.time, [0.0, 4.3, 9.3])
    np.testing.assert_allclose(log["speed"] * 3.6, [100.0, 90.0, 80.0])


def test_a_table_without_levels_in_its_head_is_refused(tmp_path: Path) -> None:
    options = ReadOptions(split_times="elapsed", split_runs="rows")
    with pytest.raises(InputError, match="no row has speed levels"):
        read_log(table(tmp_path, LEVELS, ["0", "1", "2", "3", "4"]), MAPPING, options)


def test_init_drafts_each_run_of_a_table_of_elapsed_times(tmp_path: Path) -> None:
    rows = [
        f"{v};{t};{t + 0.1 * k};{t - 0.1 * k}".replace(".", ",")
        for k, (v, t) in enumerate(zip(LEVELS, ELAPSED, strict=True))
    ]
    (tmp_path / "a.csv").write_text("\n".join(["v [km/h];Hin 1 [s];Rückfahrt [s];t3 [s]", *rows]) + "\n")
    found, description = draft("coastdown", tmp_path / "a.csv")
    assert "direction of each run" in found.undecided
    assert description["reading"] == {"split_times": "elapsed"}
    assert description["channels"]["speed"] == {"column": "v [km/h]", "unit": "km/h"}
    runs = [(run["columns"]["time"], run["direction"]) for run in description["runs"]]
    assert runs == [("Hin 1 [s]", "out"), ("Rückfahrt [s]", "back"), ("t3 [s]", "?")]


def test_the_message_on_a_table_of_intervals_states_how_to_write_them(tmp_path: Path) -> None:
    rows = [f"{v},{v - 10},{t + 5},{t + 6 - 0.01 * v}" for v, t in zip(LEVELS, (4.2, 4.1, 4.9, 5.8, 5.7), strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(["von,bis,t1,t2", *rows]) + "\n")
    with pytest.raises(
        InputError, match=r"one row for each speed level .* 'reading: \{split_times: elapsed\}', or 'int"
    ):
        draft("coastdown", tmp_path / "a.csv")


@pytest.mark.parametrize(
    "change",
    [
        {"levels": [100.0, 90.0, 80.1, 70.0, 60.0]},  # samples of a speed
        {"times": [0.0, 4.2, 4.1, 4.9, 5.8]},  # not elapsed
        {"unit": "1/min"},
    ],
)
def test_other_columns_are_no_table_of_split_times(change: dict[str, Any]) -> None:
    case = {"levels": LEVELS, "times": ELAPSED, "unit": "km/h"} | change
    named = [("v", case["unit"], case["levels"]), ("a", "s", ELAPSED), ("b", "", case["times"])]
    columns = [Recorded(channel_info(n, u, None, np.array(x)), None, np.array(x)) for n, u, x in named]
    assert split_table(columns) is None


def test_levels_in_equal_steps_with_two_columns_of_times_are_a_table() -> None:
    named = [("v", "km/h", LEVELS), ("a", "s", ELAPSED), ("b", "", [np.nan, *ELAPSED[:-1]])]
    columns = [Recorded(channel_info(n, u, None, np.array(x)), None, np.array(x)) for n, u, x in named]
    assert split_table(columns) == SplitTable("v", "km/h", ("a", "b"))
    assert split_table(columns[:2]) is None
