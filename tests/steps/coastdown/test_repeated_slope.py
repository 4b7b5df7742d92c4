"""Hills that the runs of both directions repeat are no brakes, and brakes on such a road are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.messy_cases import estimated, prepared
from tests.plant.messy_day import Case, Run, drawn_day, drive
from vdyn_cli.steps.coastdown.coasts.repeated_slope import PlacedExcess, repeated_slope

PLACE = np.linspace(0.0, 1000.0, 51)
HILL = 0.2 * np.sin(2 * np.pi * PLACE / 400.0)


def passes(out: int, back: int) -> list[PlacedExcess]:
    forth = [PlacedExcess(1.0, PLACE, HILL) for _ in range(out)]
    return forth + [PlacedExcess(-1.0, PLACE[::-1], -HILL[::-1]) for _ in range(back)]


def hilly(seed: int) -> Case:
    """Hills of 1 % rms, whose peaks decelerate by more than ``brake_excess``."""
    return drive(seed, replace(drawn_day("undulating", seed), rms=0.01, waves="sines"))


def slowed(run: Run, begin: float, seconds: float, brake: float) -> Run:
    """The run braked by ``brake`` m/s^2 from ``begin`` s on, as long as it is faster than 1 m/s."""
    lost = brake * np.clip(run.time - begin, 0.0, seconds)
    keep = run.speed - lost > 1.0
    shorter = np.r_[0.0, np.cumsum(np.diff(run.time) * 0.5 * (lost[1:] + lost[:-1]))]
    place = run.position - shorter * (1.0 if run.direction == "out" else -1.0)
    return replace(run, time=run.time[keep], speed=(run.speed - lost)[keep], position=place[keep])


def tapped(case: Case) -> Case:
    """The second run braked by 0.4 m/s^2 for 8 s."""
    return replace(case, runs=(case.runs[0], slowed(case.runs[1], 20.0, 8.0, 0.4), *case.runs[2:]))


def stopped(case: Case, place: float) -> Case:
    """The runs out braked to rest by 0.8 m/s^2 from one place of the road on."""
    runs = [
        slowed(run, float(np.interp(place, run.position, run.time)), np.inf, 0.8) if run.direction == "out" else run
        for run in case.runs
    ]
    return replace(case, runs=tuple(runs))


def test_what_both_directions_repeat_with_opposite_signs_is_a_hill() -> None:
    for one, hill in zip(runs := passes(2, 2), repeated_slope(runs), strict=True):
        assert hill == pytest.approx(one.excess)


def test_what_one_direction_repeats_is_no_hill() -> None:
    runs = [*passes(2, 0), PlacedExcess(-1.0, PLACE[::-1], 0.0 * HILL)]
    assert all(not np.any(hill) for hill in repeated_slope(runs))
    assert all(not np.any(hill) for hill in repeated_slope(passes(3, 0)))


def test_places_that_one_direction_did_not_pass_have_no_known_hill() -> None:
    runs = [*passes(2, 0), *(PlacedExcess(-1.0, PLACE[:20][::-1], -HILL[:20][::-1]) for _ in range(2))]
    hill = repeated_slope(runs)[0]
    assert hill[:20] == pytest.approx(HILL[:20])
    assert not np.any(hill[20:])


@pytest.mark.parametrize("seed", [3, pytest.param(5, marks=pytest.mark.slow)])
def test_runs_over_steep_hills_are_used_where_the_position_is_logged(seed: int) -> None:
    case = hilly(seed)
    found = estimated(case, True)
    assert len(found.fit.runs) == len(case.runs)
    for name in ("rolling_resistance", "drag_area"):
        assert found.parameters[name].value == pytest.approx(case.truth[name], rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 5])
def test_a_braked_run_on_such_a_road_is_left_out(seed: int) -> None:
    case = hilly(seed)
    used = set(estimated(tapped(case), True, speed_window=("50 km/h", "20 km/h")).fit.runs)
    assert used == {f"run_{k}.csv" for k in range(1, len(case.runs) + 1) if k != 2}


def test_runs_of_one_direction_that_are_all_braked_at_one_place_are_cut_there() -> None:
    case = hilly(5)
    first = case.runs[0]
    place = float(first.position[np.argmax(first.speed < 11.0)])
    out = [run for run in prepared(stopped(case, place), True).problem.campaign.runs if run.heading > 0]
    assert len(out) == 4
    assert all(run.place + run.distance[-1] == pytest.approx(place, abs=60.0) for run in out)
