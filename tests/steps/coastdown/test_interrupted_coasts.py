"""An interrupted coast is used before and after the interruption, and a stop for traffic is no wrong reading."""

from __future__ import annotations

import numpy as np
import pytest

from tests.messy_cases import prepared
from tests.plant.messy_day import Case, Run, drawn_day, drive
from vdyn_cli.quantities.log_names import log_of
from vdyn_cli.steps.coastdown.problem import CoastdownProblem

DAY = drive(3, drawn_day("clean", 3))


def changed(run: Run, begin: float, lost: list[tuple[float, float]]) -> Run:
    """The run slowed from ``begin`` s on, for each duration (s) by a deceleration (m/s^2), in turn."""
    speed = run.speed.copy()
    for seconds, slower in lost:
        speed -= slower * np.clip(run.time - begin, 0.0, seconds)
        begin += seconds
    keep = speed > 1.0
    return Run(run.time[keep], speed[keep], run.position[keep], run.direction, run.start)


def day(which: range, lost: list[tuple[float, float]], begin: float = 30.0) -> CoastdownProblem:
    """A clean day on which the runs ``which`` are interrupted."""
    runs = [changed(run, begin, lost) if k in which else run for k, run in enumerate(DAY.runs)]
    problem = prepared(Case(DAY.vehicle, DAY.day, tuple(runs)), False, speed_window=("100 km/h", "20 km/h")).problem
    assert isinstance(problem, CoastdownProblem)
    return problem


@pytest.mark.parametrize("lost", [[(1.5, 1.0)], [(4.0, -0.6)]], ids=["tap of the brake", "throttle"])
def test_both_parts_of_an_interrupted_coast_are_used(lost: list[tuple[float, float]]) -> None:
    problem = day(range(1, 2), lost)
    first, second = (s for s in problem.selection.segments if s.run == 1)
    assert 22.0 < first.log.time[-1] < 30.0
    assert 30.0 < second.log.time[0] < 40.0
    (left_out,) = [r for r in problem.selection.rejected if not r.usual]
    assert (left_out.start, left_out.stop) == pytest.approx((first.log.time[-1], second.log.time[0]), abs=0.3)


@pytest.mark.slow
def test_the_sentence_counts_runs_and_parts() -> None:
    result = day(range(1, 2), [(1.5, 1.0)]).publish()
    assert "from 8 runs in 9 parts" in result.sentence
    assert (result.fit.run_count, result.fit.interval_units) == (8, 8)


def test_a_stop_for_traffic_in_all_runs_is_cut_from_all() -> None:
    """The driver brakes and drives on at the old speed: the excess is soon canceled, as that of a wrong reading."""
    for begin in (40.0, 41.0):  # against the intervals over which decelerations are averaged
        problem = day(range(8), [(2.0, 1.5), (2.5, -1.2)], begin)
        assert all(s.log.time[-1] < begin or s.log.time[0] > begin + 4.5 for s in problem.selection.segments)


def test_a_part_lies_on_the_road_behind_the_parts_before_it() -> None:
    campaign = day(range(1, 2), [(1.5, 1.0)]).campaign
    first, second = (r for r in campaign.runs if log_of(r.name) == "run_2.csv")
    assert (first.before, second.along[0]) == (0.0, second.before)
    assert second.before == pytest.approx(first.distance[-1] + 5.0 * first.speed[-1], rel=0.1)
