"""Logs: the same type for measurements and simulations, never modified in place."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log


def _log(name: str = "run", n: int = 5, **channels: list[float]) -> Log:
    return Log(name, np.arange(n) / 10.0, {k: np.array(v) for k, v in channels.items()})


def test_channels_and_clock_are_read_by_name() -> None:
    log = _log(speed=[1.0, 2.0, 3.0, 4.0, 5.0])
    assert log["speed"][2] == 3.0
    assert log["time"] is log.time
    assert "speed" in log
    assert "time" in log
    assert "torque" not in log
    assert log.duration == pytest.approx(0.4)


def test_nothing_can_be_edited_in_place_and_the_source_stays_writeable() -> None:
    source = np.array([1.0, 2.0])
    log = Log("run", np.array([0.0, 1.0]), {"speed": source})
    with pytest.raises(ValueError, match="read-only"):
        log["speed"][0] = 9.0
    source[0] = 7.0


@pytest.mark.parametrize(
    "time", [[0.0, 0.0, 1.0], [0.0, 2.0, 1.0], [0.0, np.nan, 1.0], [np.nan, 0.0, 1.0], [0.0, 1.0, np.inf], [[0.0, 1.0]]]
)
def test_a_clock_must_rise(time: list[float]) -> None:
    with pytest.raises(ValueError, match="strictly increasing"):
        Log("run", np.array(time), {})


def test_channels_must_fit_the_clock() -> None:
    with pytest.raises(ValueError, match="speed not as long as time"):
        _log(speed=[1.0, 2.0])


def test_a_window_includes_both_ends_and_may_be_empty() -> None:
    log = _log(speed=[1.0, 2.0, 3.0, 4.0, 5.0])
    assert log.between(0.1, 0.3)["speed"].tolist() == [2.0, 3.0, 4.0]
    empty = log.between(7.0, 8.0)
    assert empty.time.size == 0
    assert empty.duration == 0.0


def test_channels_are_added_to_a_new_log() -> None:
    log = Log("run", np.array([0.0, 1.0]), {"speed": np.array([1.0, 2.0])}, (Finding("run", "noisy"),))
    more = log.with_channels(torque=[3.0, 4.0])
    assert sorted(more.channels) == ["speed", "torque"]
    assert sorted(log.channels) == ["speed"]
    assert more.findings == log.findings


def test_logs_on_one_clock_can_be_subtracted() -> None:
    difference = _log("a", speed=[1.0] * 5, torque=[2.0] * 5) - _log("b", speed=[0.25] * 5)
    assert difference.name == "a - b"
    assert difference["speed"].tolist() == [0.75] * 5
    assert "torque" not in difference


def test_logs_on_two_clocks_are_never_subtracted() -> None:
    with pytest.raises(ValueError, match="not on the same clock"):
        _ = _log("a", 5, speed=[1.0] * 5) - _log("b", 4, speed=[1.0] * 4)


def test_a_log_travels_between_processes() -> None:
    log = _log(speed=[1.0, 2.0, 3.0, 4.0, 5.0])
    assert pickle.loads(pickle.dumps(log))["speed"].tolist() == log["speed"].tolist()
