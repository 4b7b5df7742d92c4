"""Logs without a column of time, whose rows follow each other at a stated rate."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.commands.drafts import draft
from tests.io.stored_logs import write
from vdyn_cli.io.channel_survey import survey, without_clock
from vdyn_cli.project.drafting.run_conditions import logged_starts
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.steps import load_step

SPEED = 65.0 - 0.04 * np.arange(900) + np.random.default_rng(1).normal(0.0, 0.02, 900)  # mph
CHANNELS = "speed: {column: Speed (mph), unit: mph}"


def described(folder: Path, reading: str, channels: str = CHANNELS, name: str = "run.csv") -> Path:
    lines = [f"{v:.4f},{50 + k % 9}," for k, v in enumerate(SPEED)]
    lines[10] = ",,"  # a second without a sample
    head = "iBike,11,english\n2010,2,2,12,52,8\n\n1.5,2.5,3.5\nSpeed (mph),Power (W),Lap\n"
    (folder / name).write_text(head + "\n".join(lines) + "\n")
    path = folder / "coast.yaml"
    path.write_text(
        "test: coastdown\nvehicle: {mass: 1500 kg, rotating_mass: 60 kg}\n"
        "environment: {temperature: 24 degC, pressure: 98.9 kPa}\n"
        f"{reading}channels: {{{channels}}}\nruns:\n  - {{log: {name}, direction: out}}\n"
    )
    return path


def test_the_time_of_a_log_follows_from_its_rate(tmp_path: Path) -> None:
    log = gather(load_step("coastdown"), described(tmp_path, "reading: {rate: 10 Hz}\n")).logs[0]
    there = np.arange(900) != 10
    assert log.time == pytest.approx(np.arange(900)[there] / 10.0)
    assert log["speed"] == pytest.approx(SPEED[there] * 0.44704, abs=1e-4)
    facts = survey(tmp_path / "run.csv")
    assert logged_starts([facts, facts]) == ()
    assert "reading: {rate: 1 Hz}" in without_clock(facts)[1]


@pytest.mark.parametrize(
    ("reading", "channels", "message"),
    [
        ("", CHANNELS, "if the logs have no time but a fixed rate, write it, such as 'reading: {rate: 1 Hz}'"),
        ("reading: {rate: 10 Hz}\n", f"time: {{column: t, unit: s}}, {CHANNELS}", "remove one of them"),
        ("reading: {rate: 10 +- 1 Hz}\n", CHANNELS, "takes a number without an uncertainty"),
        ("reading: {rate: 10 s}\n", CHANNELS, "Hz"),
    ],
)
def test_a_missing_or_doubled_time_is_refused(reading: str, channels: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        gather(load_step("coastdown"), described(tmp_path, reading, channels))
    assert message in str(refused.value)


@pytest.mark.parametrize(("head", "name", "unit"), [("", "column 1", "?"), ("speed_kmh\n", "speed_kmh", "km/h")])
def test_a_file_of_one_column_is_a_log_of_a_fixed_rate(head: str, name: str, unit: str, tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    log.write_text(head + "".join(f"{60.0 - 0.5 * k}\n" for k in range(90)))
    found, description = draft("coastdown", log)
    assert description["channels"] == {"speed": {"column": name, "unit": unit}}
    assert "rate" in found.undecided
    text = (
        found.text.replace('rate: "?"', "rate: 1 Hz")
        .replace('unit: "?"', "unit: km/h")
        .replace('.csv"}', '.csv", direction: out}')
    )
    filled = re.sub(r'"\?"(.*such as )(.+)', r"\2 #\1", text)
    (tmp_path / "coast.yaml").write_text(filled)
    (read,) = gather(load_step("coastdown"), tmp_path / "coast.yaml").logs
    assert read.time == pytest.approx(np.arange(90.0))
    assert 3.6 * read["speed"] == pytest.approx(60.0 - 0.5 * np.arange(90))


def test_one_of_several_loggers_has_a_rate_and_the_other_several_recordings(tmp_path: Path) -> None:
    time = np.arange(900) / 10.0
    motion = 25.0 - 0.1 * time + np.sin(0.6 * time)
    write("mat", tmp_path / "can", [{"speed": motion}], {"speed": "m/s"})
    rows = [f"{t:.1f},{v + part:.4f}" for part in (5.0, 0.0) for t, v in zip(time, motion, strict=True)]
    (tmp_path / "gps.csv").write_text("\n".join(["time [s],speed [m/s]", *rows]) + "\n")
    (tmp_path / "coast.yaml").write_text(
        "test: coastdown\nvehicle: {mass: 1500 kg, rotating_mass: 60 kg}\n"
        "environment: {temperature: 24 degC, pressure: 98.9 kPa}\nloggers:\n"
        "  - {channels: {time: {column: 'time [s]', unit: s}, speed: {column: 'speed [m/s]', unit: m/s}}}\n"
        "  - {channels: {speed: {column: speed, unit: m/s}}, reading: {rate: 10 Hz}}\n"
        "runs:\n  - {logs: [gps.csv, can.mat], recording: [2, null], direction: out}\n"
    )
    inputs = gather(load_step("coastdown"), tmp_path / "coast.yaml")
    assert inputs.logs[0]["speed"] == pytest.approx(motion, abs=1e-3)
    assert inputs.clocks[0].delay == pytest.approx(0.0, abs=0.01)
