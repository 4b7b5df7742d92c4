"""Descriptions and logs that a coast-down refuses with a message; damaged logs end in one or in an answer."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.coast_cases import known, logs_of, solve_day, spec_of
from tests.plant import coast, sensors
from tests.plant.vehicle import REFERENCE
from vdyn_cli.quantities.errors import InputError, ResultError, VdynError
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.step import STEP

estimate = STEP.estimate
WINDOW: dict[str, Any] = {"speed_window": ["74 km/h", "21 km/h"]}
FELT = coast.DAY.but(acceleration=sensors.ACCELEROMETER)


def message(call: Callable[[], object], kind: type[VdynError]) -> str:
    with pytest.raises(kind) as caught:
        call()
    return str(caught.value)


def test_every_missing_parameter_is_named_at_once() -> None:
    runs = coast.campaign(REFERENCE, 1)
    few = known(REFERENCE, mass=None, air_density=None)
    text = message(lambda: estimate(spec_of(runs), logs_of(runs), few), InputError)
    assert "mass" in text
    assert "air_density" in text


def test_a_backward_sign_is_named_with_the_line_to_add() -> None:
    runs = coast.campaign(REFERENCE, 1, FELT)
    logs = logs_of(runs, ("speed", "acceleration"))
    for name in ("speed", "acceleration"):
        turned = [log.with_channels(**{name: -log[name]}) for log in logs]
        text = message(lambda turned=turned: estimate(spec_of(runs), turned, known(REFERENCE)), InputError)  # type: ignore[misc]
        assert name in text
        assert "sign: -1" in text


def test_a_backward_torque_is_named() -> None:
    runs = coast.campaign(REFERENCE, 1, coast.POWERED)
    logs = [g.with_channels(drive_torque=-g["drive_torque"]) for g in logs_of(runs, ("speed", "drive_torque"))]
    text = message(lambda: estimate(spec_of(runs), logs, known(REFERENCE, coast.POWERED)), InputError)
    assert "drive_torque" in text
    assert "sign: -1" in text


def test_nothing_left_says_why_run_by_run() -> None:
    settings = {"speed_window": ["160 km/h", "60 km/h"]}
    text = message(lambda: solve_day(REFERENCE, 1, settings=settings), ResultError)
    assert "run_1.csv" in text
    assert "speed window" in text


def test_powered_windows_need_a_drive() -> None:
    text = message(lambda: solve_day(REFERENCE, 1, settings={"windows": "powered"}), InputError)
    assert "drive_torque" in text


def test_with_everything_fixed_there_is_nothing_to_find() -> None:
    fix = {"drag_coefficient": 0.25, "rolling_resistance": 0.01}
    assert "no parameter is left" in message(lambda: solve_day(REFERENCE, 1, settings={"fix": fix}), InputError)


def test_one_run_alone_gives_an_answer_that_knows_its_limits() -> None:
    runs = coast.campaign(REFERENCE, 1, coast.WIDE.but(runs=1))
    result = estimate(spec_of(runs), logs_of(runs), known(REFERENCE))
    low, high = result.parameters["rolling_resistance"].interval95
    assert low < 0.0095 < high


def test_a_constant_speed_is_no_coast() -> None:
    time = np.arange(0.0, 60.0, 0.1)
    runs = coast.campaign(REFERENCE, 1, coast.DAY.but(runs=2))
    logs = [Log(f"run_{k}.csv", time, {"speed": np.full(time.size, 20.0)}) for k in (1, 2)]
    assert "not a coast-down" in message(lambda: estimate(spec_of(runs), logs, known(REFERENCE)), ResultError)


@pytest.mark.slow
@settings(max_examples=6, deadline=None)
@given(
    st.integers(0, 2**31),
    st.sampled_from(["gap", "noise", "jump", "frozen", "short", "rising", "nan", "huge"]),
    st.sampled_from([("speed",), ("speed", "acceleration")]),
)
@example(1157, "noise", ("speed",))  # the noise hid that the car slows down
def test_damaged_logs_end_in_an_answer_or_a_message(seed: int, damage: str, channels: tuple[str, ...]) -> None:
    rng = np.random.default_rng(seed)
    runs = coast.campaign(REFERENCE, 21, FELT.but(runs=2))
    logs = [hurt(log, damage, rng) for log in logs_of(runs, channels)]
    with suppress(VdynError):
        result = estimate(spec_of(runs, settings=WINDOW), logs, known(REFERENCE))
        assert all(np.isfinite(e.value) for e in result.parameters.values())


def hurt(log: Log, damage: str, rng: np.random.Generator) -> Log:
    """What loggers do on a bad day."""
    speed, n = log["speed"].copy(), log.time.size
    at = int(rng.integers(n))
    if damage == "gap":
        speed[at : at + int(rng.integers(1, 600))] = np.nan
    elif damage == "noise":
        speed += rng.normal(0.0, 10 ** rng.uniform(-2, 1), n)
    elif damage == "jump":
        speed[at:] += rng.normal(0.0, 3.0)
    elif damage == "frozen":
        speed[at:] = speed[at]
    elif damage == "short":
        return log.between(0.0, float(log.time[max(at, 1)]))
    elif damage == "rising":
        speed = speed[::-1].copy()
    elif damage == "nan":
        speed[rng.random(n) < rng.uniform()] = np.nan
    else:
        speed[at] = 1e6
    return log.with_channels(speed=speed)
