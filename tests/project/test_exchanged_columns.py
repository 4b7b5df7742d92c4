"""One run with exchanged columns among correct runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.reader import Column
from vdyn_cli.project.checks.exchanged_columns import exchanged_columns
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log

TIME = np.arange(0.0, 60.0, 0.05)
COLUMNS = {"time": ("t", "s", "s"), "speed": ("v", "km/h", "m/s"), "drive_torque": ("T", "N m", "N m")}
GENERATOR = np.random.default_rng(5)


def drive(k: int, exchanged: bool = False, factor: float = 1.0) -> Log:
    """A drive to about 90 km/h by a torque of about 50 N m; exchanged columns are read in each other's unit."""
    torque = 50.0 * np.sin(TIME / (8.0 + k)) * factor + 0.3 * GENERATOR.standard_normal(TIME.size)
    speed = 12.0 + 12.0 * factor * (1.0 - np.cos(TIME / (8.0 + k))) + 0.02 * GENERATOR.standard_normal(TIME.size)
    if exchanged:
        speed, torque = torque / 3.6, speed * 3.6
    return Log(f"run_{k}.csv", TIME, {"speed": speed, "drive_torque": torque})


@pytest.mark.parametrize("which", [0, 2])
def test_exchanged_columns_are_named_with_the_keys_that_correct_them(which: int) -> None:
    logs = [drive(k, exchanged=k == which) for k in range(4)]
    (finding,) = exchanged_columns(logs, COLUMNS, [{}] * 4)
    assert finding.where == f"run_{which}.csv"
    assert '\'columns: {speed: "T", drive_torque: "v"}, units: {speed: km/h, drive_torque: N m}\'' in finding.remedy
    stated = [{"speed": "T", "drive_torque": "v"} if k == which else {} for k in range(4)]
    assert not list(exchanged_columns(logs, COLUMNS, stated))


def test_other_drives_are_not_exchanged() -> None:
    """No finding for slower and faster runs, for a run at rest, or with too few runs."""
    assert not list(
        exchanged_columns([drive(k, factor=f) for k, f in enumerate((1.0, 0.4, 1.5, 0.7))], COLUMNS, [{}] * 4)
    )
    rest = Log("run_9.csv", TIME, {"speed": 0.0 * TIME, "drive_torque": 0.0 * TIME})
    assert not list(exchanged_columns([*(drive(k) for k in range(3)), rest], COLUMNS, [{}] * 4))
    assert not list(exchanged_columns([drive(k, exchanged=k == 2) for k in range(3)], COLUMNS, [{}] * 3))


def test_a_clock_in_another_column_is_named(tmp_path: Path) -> None:
    rows = [f"{30.0 - 0.4 * t:.3f},{t:.2f}" for t in TIME]
    (tmp_path / "run.csv").write_text("\n".join(["t,v", *rows]) + "\n")
    with pytest.raises(InputError, match="exchange the columns of 'time' and 'speed' in the"):
        read_log(tmp_path / "run.csv", {"time": Column("t", "s", "s"), "speed": Column("v", "m/s", "m/s")})
