"""Of a log with several coast-downs one is used, and the others are named."""

from __future__ import annotations

import numpy as np
import pytest

from tests.coast_cases import known, logs_of, spec_of
from tests.plant import coast
from tests.plant.vehicle import random_vehicle
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment, RejectedSegment, coast_segment, split
from vdyn_cli.steps.coastdown.step import STEP


def joined(first: Log, second: Log) -> Log:
    """Both runs in one log, with a brake, a rest of 20 s and a start between them."""
    step = float(np.median(np.diff(first.time)))
    ends = float(first["speed"][-1]), float(second["speed"][0])
    between = np.concatenate(
        [np.arange(ends[0], 0.0, -4.0 * step), np.zeros(round(20.0 / step)), np.arange(0.0, ends[1], 2.0 * step)]
    )
    speed = np.concatenate([first["speed"], between, second["speed"]])
    return Log(first.name, step * np.arange(speed.size), {"speed": speed})


@pytest.mark.slow
def test_another_coast_down_of_the_log_is_named_with_its_times() -> None:
    vehicle = random_vehicle(7)
    runs = coast.campaign(vehicle, 7)
    logs = logs_of(runs)
    whole = [joined(logs[0], logs[2]), *logs[1:]]
    whole = [log for k, log in enumerate(whole) if k != 2]
    kept = [run for k, run in enumerate(runs) if k != 2]
    result = STEP.estimate(spec_of(kept), whole, known(vehicle))
    (found,) = [f for f in result.findings if "another coast-down" in f.what]
    assert found.where == logs[0].name
    left = np.sort([float(word) for word in found.what.replace(":", "").split() if word.replace(".", "").isdigit()])
    assert left[0] > logs[0].time[-1]
    alone = STEP.estimate(spec_of(kept), [logs[0], *whole[1:]], known(vehicle))
    low, high = alone.parameters["drag_area"].interval95
    assert low < result.parameters["drag_area"].value < high


def held_before(log: Log, seconds: float, noise: float, rng: np.random.Generator) -> Log:
    """The log at 2 Hz with a drive at its first speed before it, and a receiver's noise."""
    step = 0.5
    first = float(log["speed"][:20].mean())
    falling = np.interp(np.arange(log.time[0], log.time[-1], step), log.time, log["speed"])
    speed = np.concatenate([np.full(round(seconds / step), first), falling])
    return Log(log.name, step * np.arange(speed.size), {"speed": speed + rng.normal(0.0, noise, speed.size)})


@pytest.mark.slow
@pytest.mark.parametrize("seed", [7, 8, 9])
def test_a_speed_that_is_held_before_the_driver_lets_go_is_no_coast(seed: int) -> None:
    vehicle = random_vehicle(seed)
    runs = coast.campaign(vehicle, seed)[:6]
    rng = np.random.default_rng(seed)
    alone = STEP.estimate(spec_of(runs), [held_before(log, 0.0, 0.08, rng) for log in logs_of(runs)], known(vehicle))
    held = STEP.estimate(spec_of(runs), [held_before(log, 15.0, 0.08, rng) for log in logs_of(runs)], known(vehicle))
    for name in ("rolling_resistance", "drag_area"):
        low, high = held.parameters[name].interval95
        assert low < alone.parameters[name].value < high
        assert high - low < 2.0 * np.ptp(alone.parameters[name].interval95)


@pytest.mark.parametrize("scattered", [False, True], ids=["a dead sensor", "lost rows"])
def test_a_coast_is_used_before_and_after_a_gap_of_its_speed(scattered: bool) -> None:
    """Rows that are lost all over a coast leave no part that is whole."""
    time = np.arange(0.0, 120.0, 0.1)
    gone = np.random.default_rng(1).random(time.size) < 0.3 if scattered else (time > 50.0) & (time < 85.0)
    speed = np.where(gone, np.nan, 30.0 - 0.2 * time)
    found = coast_segment(0, Log("run.csv", time, {"speed": speed}), None, 10.0)
    if scattered:
        assert isinstance(found, RejectedSegment)
        assert "the speed is missing in" in found.why
    else:
        assert isinstance(found, CoastSegment)
        first, second = split(found)
        assert (first.log.time[-1], second.log.time[0]) == pytest.approx((50.0, 85.0))
