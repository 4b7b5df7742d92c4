"""Copies of a recording under other names, cut, shifted or packed; and runs that are only similar."""

from __future__ import annotations

import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from vdyn_cli.project.checks.repeated_runs import repeated_runs
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps import load_step


def recording(seed: int, size: int = 2000, digits: int = 2) -> Log:
    """A coast-down from 30 m/s as a logger writes it."""
    chance = np.random.default_rng(seed)
    time = np.arange(size) * 0.05
    speed = np.round(30.0 - 0.2 * time + chance.normal(0.0, 0.03, size), digits)
    return Log(f"run_{seed}.csv", time, {"speed": speed, "wind_speed": np.zeros(size)})


def said(*logs: Log) -> list[str]:
    return [str(f) for f in repeated_runs(logs, [f"coast.yaml:{k + 1}" for k in range(len(logs))])]


def test_independent_runs_are_no_copies() -> None:
    assert said(*(recording(seed) for seed in range(8))) == []
    assert said(*(recording(seed, digits=1) for seed in range(8))) == []
    assert said(recording(1)) == []


def test_a_copy_is_named_with_the_place_of_the_first() -> None:
    (found,) = said(recording(1), recording(2), replace(recording(1), name="again.csv"))
    assert found.startswith("coast.yaml:3: again.csv has the same samples as run_1.csv (got first at coast.yaml:1)")


@pytest.mark.parametrize("name", ["splits_{}.csv", "splits.csv"])
def test_split_times_of_runs_at_the_same_speeds_are_no_copies(name: str) -> None:
    speed = np.arange(120.0, 0.0, -5.0) / 3.6
    chance = np.random.default_rng(5)
    runs = [Log(name.format(k), np.cumsum(chance.normal(5.0, 0.2, 24)), {"speed": speed}) for k in range(6)]
    assert said(*runs) == []
    assert len(said(*runs, replace(runs[2], time=runs[2].time - 1.5))) == 1


def test_a_copy_with_rounded_times_is_found() -> None:
    """At 60 Hz, times in whole milliseconds have steps of 16 and 17 ms."""
    run = recording(1)
    run = replace(run, time=np.arange(run.time.size) / 60)
    assert len(said(run, replace(run, name="again.csv", time=np.round(run.time + 3.2173, 3)))) == 1


@pytest.mark.parametrize("start", [0.0, 30.0, 51.0])
def test_a_part_of_a_log_is_a_copy(start: float) -> None:
    assert len(said(recording(1), recording(1).between(start, start + 40.0))) == 1


def test_windows_that_share_more_than_half_are_copies_and_neighbors_are_not() -> None:
    log = recording(1)
    assert said(log.between(0.0, 50.0), log.between(50.0, 100.0)) == []
    (found,) = said(log.between(0.0, 60.0), log.between(20.0, 80.0))
    assert "66 % of its samples in common" in found


def test_a_copy_with_a_shifted_clock_or_rows_of_another_order_of_columns() -> None:
    log = recording(1)
    shifted = replace(log, time=log.time + 1234.5)
    turned = replace(log, channels=dict(reversed(log.channels.items())))
    assert len(said(log, shifted, turned)) == 2


def test_a_copy_in_the_same_file_that_is_cut_at_other_times_is_found() -> None:
    log = recording(1)
    copy = replace(log, name="run_1.csv (704 to 790 s)", time=log.time + 700.0).between(704.0, 790.0)
    (found,) = said(recording(2), log.between(3.5, 95.0), copy)
    assert found.startswith("coast.yaml:3: run_1.csv (704 to 790 s) has the same samples as run_1.csv")
    assert said(log.between(0.0, 50.0), copy.between(745.0, 790.0)) == []


def test_standing_still_is_the_same_in_every_log() -> None:
    """Two drives from rest, parked for most of the log."""

    def parked(seed: int) -> Log:
        log = recording(seed)
        speed = np.where(np.arange(2000) < 1500, 0.0, log["speed"])
        return log.with_channels(speed=speed)

    assert said(parked(1), parked(2)) == []
    assert said(*(log.with_channels(speed=np.zeros(2000)) for log in (recording(1), recording(2)))) == []


def test_coarse_coast_downs_from_one_speed_are_no_copies() -> None:
    """Whole km/h at whole seconds, as of an OBD adapter: 61 % of the samples are equal."""
    times = np.arange(0.0, 130.0, 2.5).round()
    runs = [
        Log(f"drive_{k}.csv", times, {"speed": np.round(104.0 - 0.63 * times + 0.35 * np.sin(times / (9.0 + 5.0 * k)))})
        for k in range(2)
    ]
    assert np.mean(runs[0]["speed"] == runs[1]["speed"]) > 0.5
    assert said(*runs) == []
    assert len(said(*runs, replace(runs[0], name="copy.csv"))) == 1


@pytest.mark.slow
def test_many_long_logs_are_compared_by_a_sample_of_their_rows() -> None:
    logs = [recording(seed, 400_000, 4) for seed in range(4)]
    assert said(*logs) == []
    assert len(said(*logs, logs[2].between(500.0, 9000.0))) == 1


@pytest.mark.parametrize(
    ("runs", "says"),
    [
        ("[{log: a.csv}, {log: ./a.csv}]", "the same log is listed twice"),
        ("[{log: a.csv}, {log: sub/../a.csv}]", "the same log is listed twice"),
        ("[{log: a.csv}, {log: link.csv}]", "has the same samples as"),
        ("[{log: a.csv}, {log: copy.csv}]", "has the same samples as"),
        ("[{log: a.csv}, {log: packed.csv.gz}]", "has the same samples as"),
        ("[{log: a.csv, to_time: 20 s}, {log: a.csv, from_time: 19 s}]", "time window overlaps"),
    ],
)
def test_one_log_under_two_names_is_refused(runs: str, says: str, tmp_path: Path, root: Path) -> None:
    content = (root / "sample_logs" / "coast_1.csv").read_bytes()
    (tmp_path / "sub").mkdir()
    (tmp_path / "a.csv").write_bytes(content)
    (tmp_path / "copy.csv").write_bytes(content)
    (tmp_path / "packed.csv.gz").write_bytes(gzip.compress(content))
    (tmp_path / "link.csv").symlink_to("a.csv")
    described = yaml.safe_load((root / "configs" / "coastdown.yaml").read_text())
    described["runs"] = yaml.safe_load(runs)
    described["vehicle"] = {"mass": "1600 kg"}
    (tmp_path / "coast.yaml").write_text(yaml.safe_dump(described))
    with pytest.raises(InputError, match=says) as refused:
        gather(load_step("coastdown"), tmp_path / "coast.yaml")
    assert len([f for f in refused.value.findings if "list each recording once" in f.remedy]) == 1
