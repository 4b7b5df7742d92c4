"""A coast begins where the driver lets go, whatever the speed did that was held before."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment, RejectedSegment, coast_segment

STEP = 0.02  # s


def driven(accelerated: float, held: float, wander: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """An acceleration to 20 m/s, a held speed that wanders over some 4 s, a coast of 120 s; times and speeds."""
    time = np.arange(round((accelerated + held + 120.0) / STEP)) * STEP
    speed, off = [], 0.0
    for t in time.tolist():
        if t < accelerated:
            speed.append(20.0 - (accelerated - t))
        elif t < accelerated + held:
            off += -off * STEP / 4.0 + wander * float(np.sqrt(STEP / 2.0)) * rng.normal()
            speed.append(20.0 + off)
        else:
            last = speed[-1] if speed else 20.0
            speed.append(last - (0.11 + 4e-4 * last**2) * STEP)
    return time, np.array(speed)


def begun(
    rate: float, accelerated: float, held: float, wander: float, noise: float, lines: bool = False
) -> list[float]:
    """s after the release, at which the coast of each of ten logs begins; of speeds that ``lines`` fill up to 5x."""
    rng = np.random.default_rng(31)
    found = []
    for _ in range(10):
        fine, true = driven(accelerated, held, wander, rng)
        time = np.arange(0.0, fine[-1], 1.0 / rate)
        speed = np.interp(time, fine, true) + noise * rng.normal(size=time.size)
        if lines:
            speed, time = np.interp(fine, time, speed), fine
        log = Log("run", time, {"speed": speed}, ())
        coast = coast_segment(0, log, None, 8.0)
        assert isinstance(coast, CoastSegment)
        found.append(float(coast.log.time[0]) - accelerated - held)
    return found


@pytest.mark.parametrize(
    ("rate", "accelerated", "held", "wander", "noise", "lines"),
    [
        (20.0, 0.0, 10.0, 0.0, 0.04, False),
        (20.0, 5.0, 10.0, 0.1, 0.04, False),
        (100.0, 5.0, 10.0, 0.1, 0.02, False),
        (10.0, 5.0, 8.0, 0.05, 0.02, False),
        (10.0, 5.0, 10.0, 0.05, 0.04, True),
        (20.0, 8.0, 2.0, 0.05, 0.04, False),
        (20.0, 8.0, 1.0, 0.05, 0.04, False),
        (1.0, 0.0, 3.0, 0.0, 0.05, False),
        (1.0, 8.0, 4.0, 0.05, 0.05, False),
    ],
)
def test_a_coast_begins_behind_the_release(
    rate: float, accelerated: float, held: float, wander: float, noise: float, lines: bool
) -> None:
    starts = begun(rate, accelerated, held, wander, noise, lines)
    assert min(starts) > -0.05
    assert max(starts) < 2.5


@pytest.mark.parametrize("rate", [1.0, 2.0])
def test_a_sparse_log_that_begins_with_the_coast_is_whole(rate: float) -> None:
    assert max(begun(rate, 0.0, 0.0, 0.0, 0.05)) == 0.0


@pytest.mark.parametrize("accelerated", [0.0, 8.0])
def test_a_coast_without_a_held_speed_loses_a_second_at_most(accelerated: float) -> None:
    starts = begun(50.0, accelerated, 0.0, 0.0, 0.03)
    assert min(starts) > -0.05
    assert max(starts) < 1.6


def test_a_log_that_begins_with_the_coast_is_whole() -> None:
    assert max(begun(50.0, 0.0, 0.0, 0.0, 0.03)) < 0.6  # the middle of the first second, over which noise is averaged


def test_a_log_without_a_common_row_is_rejected() -> None:
    """Two channels that are never written in the same row."""
    found = coast_segment(0, Log("run", np.empty(0), {"speed": np.empty(0)}, ()), None, 8.0)
    assert isinstance(found, RejectedSegment)
    assert "no row holds a number in every channel" in found.why


@pytest.mark.parametrize(("held", "listed"), [(10.0, True), (1.0, False)])
def test_a_speed_that_is_held_before_the_coast_is_listed(held: float, listed: bool) -> None:
    rng = np.random.default_rng(7)
    time, true = driven(5.0, held, 0.05, rng)
    log = Log("run", time, {"speed": true + 0.04 * rng.normal(size=time.size)}, ())
    coast = coast_segment(0, log, None, 8.0)
    assert isinstance(coast, CoastSegment)
    assert (coast.held is not None) == listed
    if coast.held is not None:
        assert coast.held == (pytest.approx(5.0, abs=1.0), float(coast.log.time[0]))
