"""Reports of coast-downs as VBOX Test Suite exports them: runs in rows, levels that the file does not state."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from vdyn_cli.cli import app
from vdyn_cli.io.csv.vbox_coastdown_table import likely_levels, read_report
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.reader import Column, ReadOptions
from vdyn_cli.quantities.errors import InputError

MASS, ROTATING, DENSITY, AREA, ROLLING = 1500.0, 45.0, 1.2, 0.65, 0.010
KMH = 1 / 3.6
RUNNER = CliRunner()


def times(levels: np.ndarray, wind: float) -> tuple[np.ndarray, float]:
    """Times between levels, s, and distance, m, of a coast against a headwind, m/s, by fine steps of speed."""
    fine = np.linspace(levels[0], levels[-1], 20 * (levels.size - 1) + 1)
    middle = 0.5 * (fine[1:] + fine[:-1])
    air = middle + wind
    force = MASS * 9.81 * ROLLING + 0.5 * DENSITY * AREA * air * np.abs(air)
    spent = (MASS + ROTATING) * -np.diff(fine) / force
    return spent.reshape(levels.size - 1, 20).sum(axis=1), float(spent @ middle)


def report(groups: list[np.ndarray], runs: int) -> str:
    """A report whose runs pass the groups of levels (m/s) in turn, the last run off."""
    chance = np.random.default_rng(77)
    count = sum(g.size - 1 for g in groups)
    lines = ["Test Date: 02/03/2026 10:00", "Time zone,UTC", "", ""]
    lines += [f"Run-Use,Heading,Run,Time (s),Distance (m),Start Time,Max Decel (g){',' * count},Notes"]
    for k in range(runs):
        group = groups[k // 2 % len(groups)]
        first = sum(g.size - 1 for g in groups[: k // 2 % len(groups)])
        spent, distance = times(group, chance.normal(0.0, 0.3) + (0.0 if k % 2 else 0.2))
        cells = [""] * count
        cells[first : first + spent.size] = [f"{t + chance.normal(0, 0.01):.2f}" for t in spent]
        start = f"10:{2 * k // 60 + 5:02d}:{2 * k % 60:02d}.000"
        use, heading = "Off" if k == runs - 1 else "On", "-" if k % 2 else "+"
        lines.append(f"{use},{heading},{k + 1},{spent.sum():.2f},{distance:.2f},{start},0.08,{','.join(cells)},")
    lines += [f",,Average,30.00,700.00,10:20:00.000,0.08,{','.join(['5.00'] * count)}", "", "", *lines[4:7]]
    return "\n".join(lines) + "\n"


ONE = [np.arange(100.0, 59.0, -10.0) * KMH]
TWO = [np.arange(90.0, 69.0, -5.0) * KMH, np.arange(45.0, 29.0, -5.0) * KMH]


@pytest.mark.parametrize("groups", [ONE, TWO])
def test_distances_tell_the_levels(groups: list[np.ndarray]) -> None:
    runs = read_report(report(groups, 9).splitlines())
    assert [r.used for r in runs] == [True] * 8 + [False]
    assert [r.heading for r in runs[:3]] == ["+", "-", "+"]
    for found, true in zip(likely_levels(runs), groups, strict=True):
        assert np.allclose(np.array(found) * KMH, true)


def test_a_run_is_read_by_its_number(tmp_path: Path) -> None:
    (tmp_path / "report.csv").write_text(report(TWO, 9))
    mapping = {"time": Column("3", "s", "s"), "speed": Column("level", "km/h", "m/s")}
    options = ReadOptions(split_times="intervals", split_runs="rows", levels=[list(g) for g in TWO])
    log = read_log(tmp_path / "report.csv", mapping, options)
    assert np.allclose(log["speed"], TWO[1])
    assert log.time[0] == 0.0
    assert log.time.size == TWO[1].size


@pytest.mark.parametrize(
    ("levels", "message"),
    [([], "states no speed levels"), ([[v * KMH for v in (100, 95, 90, 85, 80)]], "contradict the distance of run 1")],
)
def test_wrong_levels_are_refused_and_the_right_ones_named(
    levels: list[list[float]], message: str, tmp_path: Path
) -> None:
    (tmp_path / "report.csv").write_text(report(ONE, 4))
    mapping = {"time": Column("1", "s", "s"), "speed": Column("level", "km/h", "m/s")}
    options = ReadOptions(split_times="intervals", split_runs="rows", levels=levels)
    with pytest.raises(InputError, match=message) as caught:
        read_log(tmp_path / "report.csv", mapping, options)
    assert "[100 km/h, 90 km/h, 80 km/h, 70 km/h, 60 km/h]" in str(caught.value)


@pytest.mark.parametrize(
    "files", [{"report.csv": TWO}, pytest.param({"high.csv": TWO[:1], "low.csv": TWO[1:]}, marks=pytest.mark.slow)]
)
def test_init_drafts_a_description_that_finds_the_truth(files: dict[str, list[np.ndarray]], tmp_path: Path) -> None:
    for name, groups in files.items():
        (tmp_path / name).write_text(report(groups, 16 // len(files) + 1))
    drafted = tmp_path / "test.yaml"
    done = RUNNER.invoke(app, ["init", "coastdown", *(str(tmp_path / n) for n in files), "-o", str(drafted)])
    assert done.exit_code == 0, done.output
    shown = RUNNER.invoke(app, ["channels", str(tmp_path / next(iter(files)))]).output
    assert "A report of coast-downs, one row per run: 'vdyn init coastdown" in shown
    text = drafted.read_text()
    assert text.count("\n  - {log:") == 16  # a run that is off is a comment
    for key, value in (
        ("rotating_mass", f"{ROTATING} +- 10 kg"),
        ("mass", f"{MASS} +- 3 kg"),
        ("frontal_area", "2.2 m^2"),
        ("temperature", "20 degC"),
        ("pressure", "101 kPa"),
    ):
        text = text.replace(f'  {key}: "?"', f"  {key}: {value}")
    drafted.write_text(text)
    done = RUNNER.invoke(app, ["coastdown", str(drafted), "-o", str(tmp_path), "--no-diagnose", "-q"])
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "coastdown.json").read_text())["parameters"]
    low, high = found["rolling_resistance"]["interval95"]
    assert low < ROLLING < high
    low, high = found["drag_area"]["interval95"]
    assert low < AREA < high
    assert high - low < 0.5 * AREA


def test_starts_are_local_times_of_the_zone_in_the_head() -> None:
    """The runs state UTC; the head states when the logging began, in local time."""
    here = report(ONE, 4).replace("Test Date: 02/03/2026 10:00", "Test Date: 02/03/2026 07:00")
    assert read_report(here.splitlines())[0].clock == 10 * 3600 + 300
    there = here.replace("Time zone,UTC", "Time zone,E. South America Standard Time")
    assert read_report(there.splitlines())[0].clock == 7 * 3600 + 300


def test_starts_without_an_hour_are_not_stated() -> None:
    """A spreadsheet saves 10:05:00.000 as 05:00.0, which is no time of day."""
    text = re.sub(r"10:(\d\d:\d\d\.)000", r"\g<1>0", report(ONE, 4))
    assert all(np.isnan(run.clock) for run in read_report(text.splitlines()))


def test_init_takes_the_air_of_a_station_and_leaves_out_other_logs(tmp_path: Path) -> None:
    (tmp_path / "report.csv").write_text(report(ONE, 9))
    rows = "".join(f"02/03/2026 10:{m:02d},{20 + 0.1 * m:.1f},51,951.2,1.0\n" for m in range(50))
    head = "Time,Temp,Rel. Hum.,Station P.,Wind Speed\nyyyy-MM-dd hh:mm:ss,Celsius,%,mb,m/s\n"
    (tmp_path / "station.csv").write_text(head + rows)
    (tmp_path / "run.csv").write_text("time_s,speed_kmh\n" + "".join(f"{t},{90 - t}\n" for t in range(60)))
    names = ["run.csv", "report.csv", "station.csv"]
    found = RUNNER.invoke(
        app, ["init", "coastdown", *(str(tmp_path / n) for n in names), "-o", str(tmp_path / "c.yaml")]
    )
    assert found.exit_code == 0, found.output
    data = yaml.safe_load((tmp_path / "c.yaml").read_text())
    assert len(data["runs"]) == 8
    assert data["environment"]["pressure"].startswith("95.12")
    assert data["environment"]["temperature"].startswith("20.")  # during the runs, not over the whole file
    assert "left out: run.csv" in (tmp_path / "c.yaml").read_text()
