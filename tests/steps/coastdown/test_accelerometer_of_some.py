"""An accelerometer that fails in one run disables those of the others, with a warning."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment
from vdyn_cli.steps.coastdown.input_checks import accelerometer_findings, with_right_acceleration


def coast(name: str, acceleration: bool) -> CoastSegment:
    time = np.arange(0.0, 50.0, 0.1)
    channels = {"speed": 30.0 - 0.3 * time}
    if acceleration:
        channels["acceleration"] = -0.3 + 0.01 * np.sin(time)
    return CoastSegment(0, name, Log(name, time, channels), np.zeros(time.size, dtype=np.int64))


def test_a_run_without_acceleration_is_reported() -> None:
    (found,) = accelerometer_findings([coast("a.csv", True), coast("b.csv", False), coast("c.csv", True)])
    assert found.where == "b.csv"
    assert "1 of 3 coasts" in found.what


def test_a_day_with_or_without_is_quiet() -> None:
    for logged in (True, False):
        assert accelerometer_findings([coast("a.csv", logged), coast("b.csv", logged)]) == ()


@pytest.mark.parametrize("gain", [1.0, 1.0 / GRAVITY], ids=["m/s^2", "g read as m/s^2"])
def test_an_acceleration_in_a_wrong_unit_is_not_used(gain: float) -> None:
    whole = [coast(name, False).log for name in ("a.csv", "b.csv")]
    falls = [30.0 * np.exp(-log.time / 60.0) for log in whole]
    logs = [w.with_channels(speed=v, acceleration=-gain * v / 60.0) for w, v in zip(whole, falls, strict=True)]
    left, found = with_right_acceleration(logs)
    assert ["acceleration" in log for log in left] == [gain == 1.0] * 2
    assert ["g read as m/s^2" in f.remedy for f in found] == [True] * (gain != 1.0)
