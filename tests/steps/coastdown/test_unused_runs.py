"""Runs of a coast-down that are not used, or of which a part is cut off, with the reason."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.coast_cases import known, logs_of, off, spec_of
from tests.plant import coast
from tests.plant.vehicle import REFERENCE
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.preparation import prepare
from vdyn_cli.steps.coastdown.problem import CoastdownProblem
from vdyn_cli.steps.coastdown.step import STEP

WINDOW: dict[str, Any] = {"speed_window": ["74 km/h", "21 km/h"]}


def braked(log: Log, start: float, stop: float, deceleration: float) -> Log:
    """The driver brakes (or, negative, drives) between two times."""
    extra = np.cumsum(np.where((log.time >= start) & (log.time <= stop), deceleration, 0.0)) * 0.1
    return log.with_channels(speed=log["speed"] - extra)


def spoilt(change: Callable[[Log], Log]) -> CoastdownProblem:
    """A day whose third log is changed."""
    runs = coast.campaign(REFERENCE, 12)
    logs = logs_of(runs)
    logs[2] = change(logs[2])
    return prepare(spec_of(runs, settings=WINDOW), logs, known(REFERENCE))


def why(problem: CoastdownProblem) -> list[str]:
    return [entry.why for entry in problem.selection.rejected]


@pytest.mark.slow
def test_a_run_that_is_braked_halfway_is_rejected() -> None:
    problem = spoilt(lambda log: braked(log, 40.0, 45.0, 1.0))
    (reason,) = why(problem)
    result = problem.publish()
    assert [entry["why"] for entry in result.extra["rejected"]] == [reason]
    assert "decelerates by" in reason
    assert "brake" in reason
    assert len(result.fit.runs) == 7
    assert abs(off(result, "rolling_resistance", 0.0095)) < 3.5
    (lost,) = [f for f in result.findings if "left out" in f.what]
    assert lost.doubt
    assert lost.what.startswith("1 of 8 runs not used; ")


@pytest.mark.parametrize("window", [["200 km/h", "180 km/h"], ["15 km/h", "5 km/h"]])
def test_a_window_outside_the_logged_speeds_is_wrong_input(window: list[str]) -> None:
    runs = coast.campaign(REFERENCE, 2)
    with pytest.raises(InputError, match=r"speed_window: lies outside the logged speeds, 7\d.\d to [\d.]+ km/h"):
        prepare(spec_of(runs, settings={"speed_window": window}), logs_of(runs), known(REFERENCE))


def test_runs_of_one_direction_that_are_not_used_are_said_to_be_there() -> None:
    runs = coast.campaign(REFERENCE, 12)
    logs = [
        log.with_channels(wind_speed=30.0 + 0 * log.time) if r.direction == "out" else log
        for r, log in zip(runs, logs_of(runs), strict=True)
    ]
    found = prepare(spec_of(runs, settings=WINDOW), logs, known(REFERENCE)).publish().findings
    (one_way,) = [f for f in found if "have the same direction" in f.what]
    assert "all runs used" in one_way.what
    assert "direction 'out'" in one_way.remedy
    assert sum(f.doubt and f.what.startswith("4 of 8 runs not used") for f in found) == 4


def test_a_brake_at_the_end_is_only_cut_off() -> None:
    problem = spoilt(lambda log: braked(log, 95.0, 99.0, 1.0))
    (entry,) = problem.selection.rejected
    assert "brake" in entry.why
    assert 88 < entry.start < 95
    assert len(problem.campaign.runs) == 8
    result = problem.publish()
    assert abs(off(result, "rolling_resistance", 0.0095)) < 3.5


def test_an_engaged_driveline_is_rejected() -> None:
    (reason,) = why(spoilt(lambda log: braked(log, 0.0, 500.0, 0.1)))
    assert "engaged driveline" in reason


@pytest.mark.slow
def test_throttle_in_a_coast_is_cut_out() -> None:
    problem = spoilt(lambda log: braked(log, 30.0, 36.0, -0.6))
    (reason,) = why(problem)
    assert "throttle" in reason
    assert abs(off(problem.publish(), "rolling_resistance", 0.0095)) < 3.5


@pytest.mark.slow
def test_a_wrong_reading_that_is_taken_back_is_no_throttle() -> None:
    def swing(log: Log) -> Log:
        phase = np.clip((log.time - 30.0) / 4.0, 0.0, 1.0)
        return log.with_channels(speed=log["speed"] + 1.5 * np.sin(np.pi * phase) ** 2)

    problem = spoilt(swing)
    assert not why(problem)
    assert abs(off(problem.publish(), "rolling_resistance", 0.0095)) < 3.5


def test_a_run_that_never_reaches_the_window_is_rejected() -> None:
    (reason,) = why(spoilt(lambda log: log.between(60.0, 500.0)))
    assert "less than 50 % of the speed window" in reason


def test_a_short_run_is_rejected() -> None:
    (reason,) = why(spoilt(lambda log: log.between(0.0, 1.0)))
    assert "samples" in reason


def test_missing_samples_are_skipped_and_a_long_gap_splits_the_run() -> None:
    def holes(log: Log) -> Log:
        speed = log["speed"].copy()
        speed[::7] = np.nan
        return log.with_channels(speed=speed)

    def gap(log: Log) -> Log:
        speed = log["speed"].copy()
        speed[200:600] = np.nan
        return log.with_channels(speed=speed)

    def mostly(log: Log) -> Log:
        speed = log["speed"].copy()
        speed[np.random.default_rng(1).random(speed.size) < 0.4] = np.nan
        return log.with_channels(speed=speed)

    assert not why(spoilt(holes))
    assert not why(split := spoilt(gap))
    assert len(split.selection.segments) == len(spoilt(holes).selection.segments) + 1
    assert "missing" in why(spoilt(mostly))[0]


def test_a_windy_run_is_rejected() -> None:
    def calm(log: Log) -> Log:
        return log.with_channels(wind_speed=np.zeros(log.time.size))

    runs = coast.campaign(REFERENCE, 12)
    logs = [calm(log) for log in logs_of(runs)]
    logs[3] = logs[3].with_channels(wind_speed=np.full(logs[3].time.size, -5.0))
    assert "mean wind 18 km/h" in why(prepare(spec_of(runs, settings=WINDOW), logs, known(REFERENCE)))[0]


def test_runs_of_one_direction_are_remarked_upon() -> None:
    runs = coast.campaign(REFERENCE, 3, coast.DAY.but(one_way=True))
    problem = prepare(spec_of(runs, settings=WINDOW), logs_of(runs), known(REFERENCE))
    assert any("all runs have the same direction" in f.what for f in problem.findings)


def test_a_steep_road_is_not_taken_for_a_brake() -> None:
    """0.8 % is 0.08 m/s^2 either way: out and back differ by half, but each agrees with its like."""
    runs = coast.campaign(REFERENCE, 3, coast.DAY, {"road_grade": 0.008})
    assert not why(prepare(spec_of(runs, settings=WINDOW), logs_of(runs), known(REFERENCE)))


def test_a_brake_in_a_driven_log_is_taken_out() -> None:
    runs = coast.campaign(REFERENCE, 3, coast.POWERED)
    logs = logs_of(runs, ("speed", "drive_torque"))
    logs[1] = braked(logs[1], 60.0, 63.0, 1.0)
    result = STEP.estimate(spec_of(runs), logs, known(REFERENCE, coast.POWERED))
    (entry,) = result.extra["rejected"]
    assert "brake" in entry["why"]
    assert entry["from_s"] < 60 < 63 < entry["to_s"] < 72
    assert len(result.fit.runs) == 9  # the braked one counts as two
    for name, truth in coast.truth(REFERENCE).items():
        assert abs(off(result, name, truth)) < 3.5


def test_a_drive_without_a_driven_part_is_listed_with_the_reason() -> None:
    runs = coast.campaign(REFERENCE, 4)
    logs = [
        log.with_channels(drive_force=np.full(log.time.size, 300.0 * (k != 2))) for k, log in enumerate(logs_of(runs))
    ]
    problem = prepare(spec_of(runs, settings={"windows": "powered"}), logs, known(REFERENCE))
    assert why(problem) == ["the vehicle is never driven and faster than 3.6 km/h"]
