"""The speed of a run in which none is logged: from its acceleration."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.cg.load_windows import cut_windows, integrated_speed, rolling_flag

TIME = np.arange(0.0, 26.0, 0.01)


def ride(zero: float = 0.0, until: float = 26.0) -> tuple[Log, np.ndarray]:
    """At rest for 3 s, to 18 m/s in 6 s, braked to rest in 3.6 s; the accelerometer reads ``zero`` m/s^2 too much."""
    true = np.where((TIME > 3) & (TIME <= 9), 3.0, np.where((TIME > 14) & (TIME <= 17.6), -5.0, 0.0))
    kept = until > TIME
    speed = np.concatenate([[0.0], np.cumsum(0.01 * (true[1:] + true[:-1]) / 2)])[kept]
    noise = np.random.default_rng(1).normal(0.0, 0.05, speed.size)
    channels = {"acceleration": true[kept] + zero + noise, "front_load": np.full(speed.size, 5000.0) + noise}
    return Log("launch_1.csv", TIME[kept], {**channels, "pitch_rate": 0.01 * noise}), speed


def test_a_run_from_rest_to_rest_is_freed_of_the_zero_of_the_accelerometer() -> None:
    log, true = ride(zero=0.05)
    assert np.max(np.abs(integrated_speed(log) - true)) < 1.0
    assert np.mean(np.abs(integrated_speed(log) - true)) < 0.5


def test_a_run_that_ends_faster_than_it_began_keeps_its_gain() -> None:
    log, true = ride(until=13.0)
    assert np.max(np.abs(integrated_speed(log) - true)) < 0.2


def test_wheels_roll_only_while_the_car_moves() -> None:
    log, true = ride(zero=0.05)
    windows = cut_windows(log)
    assert np.mean(windows.channels["rolling"] != rolling_flag(true)) < 0.05
    logged = cut_windows(log.with_channels(speed=true))
    np.testing.assert_array_equal(logged.channels["rolling"], rolling_flag(true))
