"""Latencies of a bus beside fast amplifiers: each late device is named, with its delay, and the data are not faulty."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from tests.bench.hidden_logs import make
from tests.plant.hidden import Scenario
from vdyn_cli.project.execute import execute

pytestmark = [pytest.mark.slow, pytest.mark.thorough]  # whole diagnoses of the full vehicle


def delayed(folder: Path, seed: int, late: Mapping[str, float]) -> Path:
    """A description of drives without an error, but for channels that are late, s, by the beginning of their names."""
    path = make(Scenario("validate", {}, seed), folder).description
    description = yaml.safe_load(path.read_text())
    channels = description["channels"]
    for run in description["runs"]:
        rows = pd.read_csv(folder / run["log"])
        time = rows[channels["time"]["column"]].to_numpy()
        for name, channel in channels.items():
            delay = next((d for start, d in late.items() if name.startswith(start)), 0.0)
            rows[channel["column"]] = np.interp(time - delay, time, rows[channel["column"]].to_numpy())
        rows.round(5).to_csv(folder / run["log"], index=False)
    return path


@pytest.mark.parametrize("channel", ["wheel_speed", "acceleration"])
def test_a_late_device_is_named_with_its_delay(tmp_path: Path, channel: str) -> None:
    diagnosis = execute("validate", delayed(tmp_path, 63, {channel: 0.02})).document["diagnosis"]
    assert diagnosis["verdict"] == "named"
    assert delays(diagnosis) == {f"{channel}_delay": pytest.approx(0.02, abs=0.001)}


def test_three_late_channels_of_a_bus_are_named_together(tmp_path: Path) -> None:
    """Their evidence is that of other channels than the speed, so that the strongest does not explain it alone."""
    path = delayed(tmp_path, 61, {"drive_torque": 0.02, "wheel_speed": 0.03, "acceleration": 0.03, "speed": 0.06})
    description = path.read_text()
    names = ", ".join(f"{n}_delay" for n in ("speed", "torque", "wheel_speed", "shaft_torque"))
    path.write_text(f"{description}\ndiagnose: {{effects: [{names}]}}\n")
    diagnosis = execute("validate", path).document["diagnosis"]
    assert diagnosis["verdict"] == "named"
    expected = {"torque_delay": 0.02, "wheel_speed_delay": 0.03, "speed_delay": 0.06}
    assert delays(diagnosis) == pytest.approx(expected, abs=0.003)


def delays(diagnosis: Mapping[str, Any]) -> dict[str, float]:
    return {c["effect"]: c["unknowns"][c["effect"]]["value"] for c in diagnosis["causes"]}
