"""An accelerometer that fails in one run disables those of the others, with a warning."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.io.quality.acceleration_mistake import without_mistaken_acceleration
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment
from vdyn_cli.steps.coastdown.input_checks import accelerometer_findings


def coast(name: str, acceleration: bool) -> CoastSegment:
    time = np.arange(0.0, 50.0, 0.1)
    channels = {"speed": 30.0 - 0.3 * time}
    if acceleration:
        channels["acceleration"] = -0.3 + 0.01 * np.sin(time)
    log = Log(name, time, channels)
    return CoastSegment(0, name, log, np.zeros(time.size, dtype=np.int64), np.zeros(time.size), log)


def test_a_run_without_acceleration_is_reported() -> None:
    (found,) = accelerometer_findings([coast("a.csv", True), coast("b.csv", False), coast("c.csv", True)])
    assert found.where == "b.csv"
    assert "1 of 3 coasts" in found.what


def test_a_day_with_or_without_is_quiet() -> None:
    for logged in (True, False):
        assert accelerometer_findings([coast("a.csv", logged), coast("b.csv", logged)]) == ()


@pytest.mark.parametrize(
    ("gain", "remedies"),
    [
        (1.0, ()),
        (1.0 / GRAVITY, ("g read as m/s^2",)),
        (-1.0, ("sign: -1",)),
        (-1.0 / GRAVITY, ("g read as m/s^2", "sign: -1")),
    ],
    ids=["right", "g read as m/s^2", "wrong sign", "both"],
)
def test_an_acceleration_in_a_wrong_unit_or_of_a_wrong_sign_is_not_used(gain: float, remedies: tuple[str, ...]) -> None:
    whole = [coast(name, False).log for name in ("a.csv", "b.csv")]
    falls = [30.0 * np.exp(-log.time / 60.0) for log in whole]
    logs = [w.with_channels(speed=v, acceleration=-gain * v / 60.0) for w, v in zip(whole, falls, strict=True)]
    left, found = without_mistaken_acceleration(logs)
    assert ["acceleration" in log for log in left] == [not remedies] * 2
    assert [all(r in f.remedy for r in remedies) for f in found] == [True] * bool(remedies)


def test_beside_a_torque_an_acceleration_is_evidence_that_the_unit_of_the_speed_is_wrong() -> None:
    whole = [coast(name, False).log for name in ("a.csv", "b.csv")]
    falls = [30.0 * np.exp(-log.time / 60.0) for log in whole]
    logs = [w.with_channels(speed=3.6 * v, acceleration=-v / 60.0) for w, v in zip(whole, falls, strict=True)]
    left, found = without_mistaken_acceleration(logs, or_speed=False)
    assert all("acceleration" in log for log in left)
    assert ["speed in km/h read as m/s" in f.remedy for f in found] == [True]
