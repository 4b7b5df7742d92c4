"""Coasts at whose lowest speeds the motor pushes: cut there, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.coasts.creep import without_creep
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment, RejectedSegment

STEP = 0.1  # s
WAYS = ["out", "back"] * 3


def coast(random: np.random.Generator, push: float, slope: float, way: str) -> CoastSegment:
    """From 20 m/s to 1.6 m/s at 0.09 m/s^2 and air drag, the motor pushing by ``push`` m/s^2 below 2.5 m/s."""
    speeds = [20.0]
    while speeds[-1] > 1.6 and len(speeds) < 4000:
        v = speeds[-1]
        help_ = push * min(max((2.5 - v) / 0.8, 0.0), 1.0)
        speeds.append(v - STEP * (0.09 + 2.6e-4 * v**2 + 9.81 * slope - help_))
    speed = np.array(speeds) + 0.02 * random.standard_normal(len(speeds))
    log = Log("run.csv", STEP * np.arange(speed.size), {"speed": speed})
    none = np.zeros(speed.size)
    return CoastSegment(0, "run.csv", log, none.astype(np.int64), none, log, direction=way)


def cut(push: float, slope: float, ways: list[str]) -> tuple[list[CoastSegment], list[RejectedSegment]]:
    random = np.random.default_rng(4)
    return without_creep([coast(random, push, slope if way == "out" else -slope, way) for way in ways])


def test_where_the_motor_pushes_is_cut() -> None:
    found, left = cut(0.06, 0.001, WAYS)
    assert len(left) == len(WAYS)
    assert "creep" in left[0].why
    assert all(2.5 < one.log["speed"].min() < 3.6 for one in found)


@pytest.mark.parametrize(("push", "slope", "ways"), [(0.0, 0.001, WAYS), (0.0, 0.003, WAYS), (0.06, 0.0, ["out"] * 6)])
def test_a_free_coast_on_a_slope_is_kept(push: float, slope: float, ways: list[str]) -> None:
    assert cut(push, slope, ways)[1] == []
