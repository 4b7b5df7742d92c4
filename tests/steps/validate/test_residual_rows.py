"""Rows of known noise: colored noise is whitened, gusts are only in the common error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.drives.segments import DriveSegment, RunConditions, Segmentation, drive_segments
from vdyn_cli.steps.validate.fit.residual_rows import prewhitener, row_layout
from vdyn_cli.steps.validate.noise import slow_noise

RADIUS = 0.3
SPEEDS = ("speed", "wheel_speed_fl", "wheel_speed_rl")
CAR = {"mass": 1000.0, "rotating_mass": 50.0, "air_density": 1.2, "drag_area": 0.6, "wheel_radius": RADIUS}


def coloured(rng: np.random.Generator, rows: int) -> np.ndarray:
    """Two channels perturbed by one oscillating source."""
    from scipy.signal import lfilter

    shake = lfilter([0.5], [1.0, -1.6, 0.8], rng.standard_normal(rows))
    return np.column_stack([shake, 0.6 * np.r_[0.0, shake[:-1]]])


def test_coloured_noise_on_top_of_white_noise_becomes_white() -> None:
    rng = np.random.default_rng(2)
    found = prewhitener(coloured(rng, 20_000), 12)
    rows = coloured(rng, 20_000) + rng.standard_normal((20_000, 2))
    white = found.white(rows[:, :, None], np.zeros(20_000, dtype=np.int64))[:, :, 0]
    assert white.shape == (20_000 - 12, 2)
    assert np.cov(white.T) == pytest.approx(np.eye(2), abs=0.05)
    for lag in range(1, 6):
        across = white[lag:].T @ white[:-lag] / len(white)
        assert np.abs(across).max() < 0.05, lag
    assert np.var(rows[:, 0]) > 2.0


def test_rows_do_not_reach_across_a_hole() -> None:
    rng = np.random.default_rng(3)
    found = prewhitener(coloured(rng, 2_000), 4)
    part = np.r_[np.zeros(100), np.ones(100)].astype(np.int64)
    assert len(found.white(rng.standard_normal((200, 2, 1)), part)) == 200 - 2 * 4


def driven(slower: int = 1, speed: np.ndarray | None = None) -> DriveSegment:
    """A drive at 100 Hz with a speed in only one of several rows; about 10 m/s unless stated."""
    rng = np.random.default_rng(5)
    time = np.arange(0.0, 30.0, 0.01)
    speed = 10.0 + np.sin(0.2 * time) if speed is None else speed
    channels = {
        "speed": speed + 0.02 * rng.standard_normal(time.size),
        "wheel_speed_fl": speed / RADIUS + 0.01 * rng.standard_normal(time.size),
        "wheel_speed_rl": speed / RADIUS + 0.01 * rng.standard_normal(time.size),
        "drive_torque": np.full(time.size, 20.0) + 0.1 * rng.standard_normal(time.size),
    }
    channels["speed"][np.arange(time.size) % slower > 0] = np.nan
    (made,), _ = drive_segments([Log("a.csv", time, channels)], [RunConditions()], Segmentation("vehicle"))
    return made


def test_what_moves_all_speeds_alike_is_in_the_slow_rows_alone() -> None:
    s = driven()
    true = 10.0 + np.sin(0.2 * s.time)
    found = row_layout(s, SPEEDS, RADIUS, {"speed": true, **{n: true / RADIUS for n in SPEEDS[1:]}})
    push = 0.1 * s.time
    gust = {"speed": push, **{n: push / RADIUS for n in SPEEDS[1:]}}
    assert np.abs(found.fast(gust)).max() < 1e-9
    slow = found.slow({n: v[:, None] for n, v in gust.items()})[:, 0]
    assert slow == pytest.approx(found.bins.mean(push[found.keep]), abs=1e-9)
    noise = found.fast({n: s.outputs[n] - (true if n == "speed" else true / RADIUS) for n in SPEEDS})
    assert np.std(noise, axis=0) == pytest.approx(1.0, abs=0.05)
    assert np.abs(np.corrcoef(noise.T)[0, 1]) < 0.05


def test_the_slower_sensor_of_the_same_speed_counts_less() -> None:
    s = driven()
    true = 10.0 + np.sin(0.2 * s.time)
    found = row_layout(s, SPEEDS, RADIUS, {"speed": true, **{n: true / RADIUS for n in SPEEDS[1:]}})
    each = np.array([0.02, 0.01 * RADIUS, 0.01 * RADIUS])
    assert found.common_level == pytest.approx(np.sum(each**-2.0) ** -0.5, rel=0.1)


@pytest.mark.parametrize("slower", [5, 10])
def test_a_slower_speed_leaves_no_holes(slower: int) -> None:
    """If missing rows counted as gaps, every sample would be a bin, and no row would have predecessors to whiten it."""
    s = driven(slower)
    true = 10.0 + np.sin(0.2 * s.time)
    found = row_layout(s, SPEEDS, RADIUS, {"speed": true, **{n: true / RADIUS for n in SPEEDS[1:]}})
    assert found.keep.size == pytest.approx(s.time.size / slower, abs=1)
    assert found.part.max() == 0
    assert found.bins.time.size <= 61


def test_an_error_of_the_slope_is_integrated_in_the_slow_rows() -> None:
    """A slope that is 0.1 % off for 30 s changes the speed by g m/(m + mr) 0.001 30 s, and a little less with drag."""
    off, at = climbed(driven())
    assert off[-1] == pytest.approx(9.80665 * 1000.0 / 1050.0 * 0.001 * at[-1], rel=0.15)
    assert np.all(np.diff(off) > 0.0)


def test_an_error_of_the_slope_also_acts_before_the_first_row_of_a_launch() -> None:
    """A launch with 0.5 m/s^2 after 5 s of rest reaches the first row, at 2 m/s, after 4 s on a slope 0.1 % off."""
    time = np.arange(0.0, 30.0, 0.01)
    off, at = climbed(driven(speed=0.5 * np.maximum(time - 5.0, 0.0)))
    assert at[0] == pytest.approx(9.2, abs=0.1)
    assert off == pytest.approx(9.80665 * 1000.0 / 1050.0 * 0.001 * (at - 5.2), rel=0.1)


def test_the_torque_sensors_noise_counts_from_the_last_rest() -> None:
    """White noise of 300 N m moves 1050 kg over 0.3 m by 0.95 m/s^2 in samples of 0.01 s, as a random walk."""
    time = np.arange(0.0, 30.0, 0.01)
    s = driven(speed=np.maximum(np.mod(time, 15.0) - 3.0, 0.0))
    layout = row_layout(s, SPEEDS[:1], RADIUS, {"speed": s.smooth_speed}, 0.25)
    variance = np.diag(slow_noise(s, layout, layout.bins, CAR, 300.0).known)
    since = np.mod(layout.bins.time, 15.0) - 3.1
    assert variance == pytest.approx((300.0 / RADIUS / 1050.0) ** 2 * 0.01 * since, rel=0.15)


def climbed(s: DriveSegment) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviation of the slow rows of a car by a slope that is 0.1 % off, m/s, and their times, s."""
    layout = row_layout(s, SPEEDS[:1], RADIUS, {"speed": s.smooth_speed}, 0.25)
    error = np.full((s.time.size, 1), 0.001)
    without, with_error = (
        slow_noise(one, layout, layout.bins, CAR, 0.1).known for one in (s, replace(s, slope_error=error))
    )
    return np.sqrt(np.diag(with_error - without)), layout.bins.time
