"""A run that was braked is left out, whatever speed window is fitted."""

from __future__ import annotations

import numpy as np
import pytest

from tests.messy_cases import estimated, prepared
from tests.plant.messy_day import Case, Run, drawn_day, drive


def braked(case: Case, start: float = 20.0, duration: float = 8.0) -> Case:
    """The second run braked by 0.4 m/s^2 for some seconds, from ``start`` (s) on."""
    run = case.runs[1]
    lost = 0.4 * np.clip(run.time - start, 0.0, duration)
    keep = run.speed - lost > 2.0
    slower = Run(run.time[keep], (run.speed - lost)[keep], run.position[keep], run.direction, run.start)
    return Case(case.vehicle, case.day, (case.runs[0], slower, *case.runs[2:]))


@pytest.mark.parametrize(
    "window", [("100 km/h", "20 km/h"), pytest.param(("50 km/h", "20 km/h"), marks=pytest.mark.slow)]
)
def test_a_braked_run_is_out_whatever_the_window(window: tuple[str, str]) -> None:
    case = drive(3, drawn_day("clean", 3))
    for day, out in ((case, []), (braked(case), ["run_2.csv"])):
        selection = prepared(day, False, speed_window=window).problem.selection  # type: ignore[attr-defined]
        assert [one.run for one in selection.rejected] == out


@pytest.mark.slow
def test_a_short_braking_is_left_out_wherever_the_intervals_begin() -> None:
    case = drive(3, drawn_day("clean", 3))
    assert not prepared(case, False).problem.selection.rejected  # type: ignore[attr-defined]
    for start in np.arange(20.0, 22.0, 0.5):
        selection = prepared(braked(case, float(start), 3.0), False).problem.selection  # type: ignore[attr-defined]
        assert [one.run for one in selection.rejected] == ["run_2.csv"], start


@pytest.mark.slow  # a day of runs, estimated
@pytest.mark.parametrize("kind", ["undulating", "late"])
def test_hills_and_a_late_clutch_above_the_window_are_no_brakes(kind: str) -> None:
    case = drive(4, drawn_day(kind, 4))
    assert len(estimated(case, False, speed_window=("50 km/h", "20 km/h")).fit.runs) == len(case.runs)


def split(case: Case, middle: float, brake: float = 1.2) -> Case:
    """Each run the upper or the lower part of its coast, in turn in pairs, and then braked to rest by the driver."""
    runs = []
    for k, run in enumerate(case.runs):
        upper = k // 2 % 2 == 0
        part = run.speed > middle if upper else run.speed < middle + 2.0
        time, speed, position = run.time[part], run.speed[part], run.position[part]
        stop = np.arange(0.0, speed[-1] / brake, float(np.median(np.diff(time))))[1:]
        slower = speed[-1] - brake * stop
        further = np.full(stop.size, position[-1])
        runs.append(
            Run(
                np.r_[time, time[-1] + stop],
                np.r_[speed, slower],
                np.r_[position, further],
                run.direction,
                run.start,
            )
        )
    return Case(case.vehicle, case.day, tuple(runs))


def test_runs_over_half_of_the_speeds_each_are_kept_though_all_are_braked_to_rest() -> None:
    case = drive(3, drawn_day("clean", 3))
    found = estimated(split(case, 0.5 * float(case.runs[0].speed.max())), False)
    assert len(found.fit.runs) == len(case.runs)
    assert found.parameters["drag_area"].value == pytest.approx(case.vehicle.drag_area, rel=0.1)


def test_a_braked_run_is_out_where_no_window_is_stated() -> None:
    case = drive(3, drawn_day("clean", 3))
    assert "run_2.csv" not in estimated(braked(braked(case)), False).fit.runs


@pytest.mark.slow
def test_a_run_disturbed_at_both_ends_is_used_between_them() -> None:
    case = drive(3, drawn_day("clean", 3))
    run = case.runs[1]
    time = run.time - run.time[0]
    changed = run.speed + 0.5 * np.clip(6.0 - time, 0.0, None) - 1.2 * np.clip(time - time[-1] + 4.0, 0.0, None)
    keep = changed > 0.5
    other = Run(run.time[keep], changed[keep], run.position[keep], run.direction, run.start)
    case = Case(case.vehicle, case.day, (case.runs[0], other, *case.runs[2:]))
    problem = prepared(case, False).problem
    assert len(problem.publish().fit.runs) == len(case.runs)
    left = [r for r in problem.selection.rejected if r.run == "run_2.csv"]  # type: ignore[attr-defined]
    first, last = sorted(left, key=lambda r: r.start)
    assert last.start - first.stop > 80.0
