"""Interpolated channels are distinguished from channels as measured."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.io.clocks.interpolated_values import sampled_rows
from vdyn_cli.io.quality.channel_quality import check_channel
from vdyn_cli.quantities.log import Log

SLOW = np.arange(0.0, 60.0, 0.1)
FAST = np.arange(0.0, 59.9, 0.01)


def speed(time: np.ndarray, noise: float = 0.2) -> np.ndarray:
    """km/h, of a coast-down."""
    return np.asarray(80 - time + 0.002 * time**2 + noise * np.random.default_rng(3).standard_normal(time.size))


@pytest.mark.parametrize("digits", [2, 3, 8])
@pytest.mark.parametrize("late", [0.0, 0.03])
def test_the_rows_are_found_at_which_it_was_measured(digits: int, late: float) -> None:
    joined = np.round(np.interp(FAST, SLOW + late, speed(SLOW)), digits)
    own = sampled_rows(joined)
    assert own is not None
    assert np.array_equal(own, np.arange(round(100 * late), FAST.size, 10))


@pytest.mark.parametrize("spacing", [2, 10, 100])
def test_any_rate_is_found(spacing: int) -> None:
    time = np.arange(0.0, 60.0 * spacing / 10, 0.01)
    slow = time[::spacing]
    own = sampled_rows(np.interp(time, slow, speed(slow) if spacing < 100 else 20 + speed(slow, 0.5) / 50))
    assert own is not None
    assert own[1] - own[0] == spacing


JOINED = np.interp(FAST, SLOW, speed(SLOW))


@pytest.mark.parametrize(
    "values",
    [
        np.array([float(f"{v / 3.6:.6g}") for v in JOINED]),  # six digits, through 10 m/s
        JOINED.astype(np.float32).astype(float),
        np.r_[np.full(9000, 80.0), JOINED],  # at rest for more than half
        np.where(np.arange(FAST.size) == 3005, JOINED + 18, JOINED),  # a glitch
        np.r_[JOINED[:5700], JOINED[5701:]],  # a row lost near the end
        np.where(np.arange(FAST.size) % 977 == 0, np.nan, JOINED),
    ],
)
def test_what_loggers_do_to_it_hides_nothing(values: np.ndarray) -> None:
    own = sampled_rows(values)
    assert own is not None
    assert own[1] - own[0] == 10


@pytest.mark.parametrize("size", [0, 1, 2, 40])
def test_too_little_shows_nothing(size: int) -> None:
    assert sampled_rows(JOINED[:size]) is None


@pytest.mark.parametrize("digits", [1, 2, 8])
def test_what_was_measured_at_every_row_is_left_alone(digits: int) -> None:
    assert sampled_rows(np.round(speed(FAST), digits)) is None


@pytest.mark.parametrize(
    "values",
    [
        np.round(speed(FAST, 0.0), 2),  # smooth and rounded
        np.interp(FAST, [0, 10, 10.3, 30, 31, 60], [0, 0, 300, 300, 20, 20]),  # ramps and plateaus
        np.repeat(speed(SLOW), 10),  # held
        np.sin(FAST),
        np.full(FAST.size, 3.0),
        np.full(FAST.size, np.nan),
    ],
)
def test_other_signals_are_not_interpolated(values: np.ndarray) -> None:
    assert sampled_rows(values) is None


def test_the_reader_says_so() -> None:
    joined = np.round(np.interp(FAST, SLOW, speed(SLOW)), 3)
    log = Log("run.csv", FAST, {"speed": joined})
    (found,) = check_channel(log, "speed", "km/h").findings
    assert "changes its slope only once in 10 rows" in found.what
