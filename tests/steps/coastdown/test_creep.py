"""Coasts at whose lowest speeds the motor pushes: cut there, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.coasts.creep import without_creep
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment, RejectedSegment

STEP = 0.1  # s
WAYS = ["out", "back"] * 3


def coast(
    random: np.random.Generator, push: float, slope: float, way: str, rounded: float = 0.0, stop: float = 1.6
) -> CoastSegment:
    """From 20 m/s to ``stop`` at 0.09 m/s^2 and air drag, the motor pushing by ``push`` m/s^2 below 2.5 m/s."""
    speeds = [20.0]
    while speeds[-1] > stop and len(speeds) < 4000:
        v = speeds[-1]
        help_ = push * min(max((2.5 - v) / 0.8, 0.0), 1.0)
        speeds.append(v - STEP * (0.09 + 2.6e-4 * v**2 + 9.81 * slope - help_))
    speed = np.array(speeds) + 0.02 * random.standard_normal(len(speeds))
    speed = rounded * np.round(speed / rounded) if rounded else speed
    log = Log("run.csv", STEP * np.arange(speed.size), {"speed": speed})
    none = np.zeros(speed.size)
    return CoastSegment(0, "run.csv", log, none.astype(np.int64), none, log, direction=way)


def cut(
    push: float, slope: float, ways: list[str], rounded: float = 0.0
) -> tuple[list[CoastSegment], list[RejectedSegment]]:
    random = np.random.default_rng(4)
    return without_creep([coast(random, push, slope if way == "out" else -slope, way, rounded) for way in ways])


@pytest.mark.parametrize("rounded", [0.0, 1.0 / 3.6])
def test_where_the_motor_pushes_is_cut(rounded: float) -> None:
    found, left = cut(0.06, 0.001, WAYS, rounded)
    assert len(left) == len(WAYS)
    assert "creep" in left[0].why
    assert all(2.5 < one.log["speed"].min() < 3.6 for one in found)


@pytest.mark.parametrize(("push", "slope", "ways"), [(0.0, 0.001, WAYS), (0.0, 0.003, WAYS), (0.06, 0.0, ["out"] * 6)])
def test_a_free_coast_on_a_slope_is_kept(push: float, slope: float, ways: list[str]) -> None:
    assert cut(push, slope, ways)[1] == []


def test_steps_of_a_speed_that_ends_within_one_are_no_creep() -> None:
    """Coasts until just below 14.5 km/h, logged in whole km/h."""
    random = np.random.default_rng(4)
    coasts = [coast(random, 0.0, 0.0, way, rounded=1.0 / 3.6, stop=4.0) for way in WAYS]
    assert without_creep(coasts)[1] == []
