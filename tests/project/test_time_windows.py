"""Windows of a run whose clock counts from 1970: a time counted from the log's start is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.steps import load_step

BEGIN = 1_759_480_000.0  # s, since 1970


def described(folder: Path, window: str, begin: float = BEGIN) -> Path:
    """One coast-down of 90 s, with a window."""
    time = np.arange(0.0, 90.0, 0.1)
    speed = 30.0 - 0.2 * time + np.random.default_rng(1).normal(0.0, 0.02, time.size)
    rows = (f"{begin + t:.2f},{v:.3f}" for t, v in zip(time, speed, strict=True))
    (folder / "a.csv").write_text("\n".join(["t,v", *rows]))
    path = folder / "coast.yaml"
    path.write_text(
        "test: coastdown\nvehicle: {mass: 1500 kg, rotating_mass: 60 kg}\n"
        "environment: {temperature: 24 degC, pressure: 98.9 kPa}\n"
        "channels: {time: {column: t, unit: s}, speed: {column: v, unit: m/s}}\n"
        f"runs:\n  - {{log: a.csv, direction: out, {window}}}\n"
    )
    return path


@pytest.mark.parametrize(
    ("window", "remedy"),
    [
        ("from_time: 19 s", "from_time: 1759480019 s"),
        ("to_time: 60 s", "to_time: 1759480060 s"),
        ("from_time: 1759480050 s, to_time: 1759480020 s", "exchange them"),
        ("from_time: 1759481000 s", "spans 1759480000 s to 1759480089.9 s"),
    ],
)
def test_a_time_on_another_clock_is_refused(window: str, remedy: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        gather(load_step("coastdown"), described(tmp_path, window))
    assert remedy in str(refused.value)
    assert "e+09" not in str(refused.value)


@pytest.mark.parametrize(("window", "begin"), [("from_time: 0 s", BEGIN), ("from_time: 0.2 s", 0.5)])
def test_a_window_that_begins_before_the_log_is_the_whole_log(window: str, begin: float, tmp_path: Path) -> None:
    assert gather(load_step("coastdown"), described(tmp_path, window, begin)).logs[0].time[0] == begin


def test_runs_of_one_log_are_named_with_their_times(tmp_path: Path) -> None:
    path = described(tmp_path, "to_time: 1759480040 s")
    path.write_text(path.read_text() + "  - {log: a.csv, direction: back, from_time: 1759480045 s}\n")
    inputs = gather(load_step("coastdown"), path)
    assert [log.name for log in inputs.logs] == ["a.csv (to 1759480040 s)", "a.csv (from 1759480045 s)"]
