"""A car that was changed between two runs is named with the values before and after; warming and slow wind are not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest

from tests.coast_cases import known, logs_of, spec_of
from tests.messy_cases import prepared as messy_prepared
from tests.plant import coast, messy_day
from tests.plant.coast import Run
from tests.plant.vehicle import REFERENCE, Vehicle
from vdyn_cli.diagnosis.diagnose import diagnosed
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep
from vdyn_cli.steps.coastdown.campaign_checks.track_check import track_check
from vdyn_cli.steps.coastdown.problem import CoastdownProblem
from vdyn_cli.steps.coastdown.step import STEP

DAY = coast.DAY.but(start_speed=32.0, end_speed=5.0, rate=5.0)
SEED = 11


def prepared(runs: Sequence[Run]) -> PreparedStep:
    spec, of_car = spec_of(runs), known(REFERENCE, DAY)
    return PreparedStep(STEP, spec, of_car, STEP.prepare(spec, logs_of(runs), of_car))


def first_changed(runs: Sequence[Run]) -> int | None:
    """Index of the first run after the change that the problem finds."""
    problem = prepared(runs).problem
    assert isinstance(problem, CoastdownProblem)
    return next((k for k, run in enumerate(problem.campaign_on_road.runs) if run.changed), None)


def driven_with(after: Vehicle, seed: int = SEED, effects: dict[str, float] | None = None) -> list[Run]:
    """Eight runs, of which the last four are of another car."""
    return [*coast.campaign(REFERENCE, seed, DAY, effects)[:4], *coast.campaign(after, seed, DAY, effects)[4:]]


CHANGES: dict[str, dict[str, Any]] = {
    "pumped tires": {"rolling_resistance": 0.84 * REFERENCE.rolling_resistance},
    "a roof box": {"drag_coefficient": 1.2 * REFERENCE.drag_coefficient},
    "a trailer": {"mass": 1.4 * REFERENCE.mass, "drag_coefficient": 1.2 * REFERENCE.drag_coefficient},
}


@pytest.mark.slow
@pytest.mark.parametrize("hidden", CHANGES)
def test_the_run_after_the_change_is_found(hidden: str) -> None:
    assert first_changed(driven_with(replace(REFERENCE, **CHANGES[hidden]))) == 4


@pytest.mark.slow
def test_the_order_of_the_description_does_not_matter_where_the_starts_are_stated() -> None:
    """As a shell lists them: all runs back before all runs out."""
    runs = driven_with(replace(REFERENCE, **CHANGES["a roof box"]))
    assert first_changed(sorted(runs, key=lambda run: run.direction)) == 4


@pytest.mark.slow
def test_passengers_who_change_only_the_drag_per_mass_are_found() -> None:
    """With rolling resistance and drag area both free, the evidence for a tenth more mass is 2 to 3 too small."""
    assert first_changed(driven_with(replace(REFERENCE, mass=1.1 * REFERENCE.mass), seed=12)) == 4


@pytest.mark.slow
def test_a_roof_box_in_two_runs_is_named_and_noted_by_the_check() -> None:
    """In the third and fourth run; their means alone differ by less than the scatter of eight runs shows."""
    boxed = replace(REFERENCE, drag_coefficient=1.15 * REFERENCE.drag_coefficient)
    runs = coast.campaign(REFERENCE, SEED, DAY)
    runs = [*runs[:2], *coast.campaign(boxed, SEED, DAY)[2:4], *runs[4:]]
    ready = prepared(runs)
    result = diagnosed(ready, ready.problem.publish())
    assert result.diagnosis is not None
    assert "changed_car" in result.diagnosis.extended
    low, high = result.parameters["drag_area"].interval95
    assert low < REFERENCE.drag_area < high
    assert "(of the car as in all but run_3.csv and run_4.csv)" in result.sentence
    found = track_check(spec_of(runs), logs_of(runs), logs_of(runs), known(REFERENCE, DAY), tuple(range(8)))
    assert [f.where for f in found.findings if "% higher than" in f.what] == ["run_3.csv", "run_4.csv"]


@pytest.mark.slow
@pytest.mark.parametrize("effects", [{}, {"tire_warmup": 0.3}, {"headwind": 1.5}, {"road_grade": 1e-3}], ids=str)
@pytest.mark.parametrize("seed", [11, *(pytest.param(n, marks=pytest.mark.thorough) for n in (12, 13))])
def test_a_day_without_a_change_has_none(effects: dict[str, float], seed: int) -> None:
    assert first_changed(coast.campaign(REFERENCE, seed, DAY, effects)) is None


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "seed"), [("drifting", 40), ("late", 41)])
def test_a_slow_wind_is_no_change(kind: str, seed: int) -> None:
    """Its period of 15 min is about three runs, so that four runs in succession meet more of it than the others."""
    case = messy_day.drive(seed, messy_day.drawn_day(kind, seed))
    problem = messy_prepared(case, position=False).problem
    assert isinstance(problem, CoastdownProblem)
    assert not any(run.changed for run in problem.campaign_on_road.runs)


@pytest.mark.slow
@pytest.mark.parametrize(
    "hidden",
    [
        pytest.param(n, marks=[pytest.mark.thorough] if n in ("a trailer", "pumped tires", "a roof box") else [])
        for n in CHANGES
    ],
)
def test_a_changed_car_is_named_with_both_sides(hidden: str) -> None:
    after = replace(REFERENCE, **CHANGES[hidden])
    ready = prepared(driven_with(after))
    result = diagnosed(ready, ready.problem.publish())
    assert result.diagnosis is not None
    assert result.diagnosis.extended == ("changed_car",)
    for name, true in coast.truth(REFERENCE).items():
        low, high = result.parameters[name].interval95
        assert low < true < high
    (cause,) = result.diagnosis.causes
    heavier = REFERENCE.mass / after.mass  # a stated mass that is too small decreases the drag per mass
    changes = {
        "changed_rolling": after.rolling_resistance / REFERENCE.rolling_resistance - 1.0,
        "changed_drag": heavier * after.drag_area / REFERENCE.drag_area - 1.0,
    }
    for name, true in changes.items():
        low, high = cause.unknowns[name].interval95
        assert low - 0.02 < true < high + 0.02  # rotating parts do not become heavier
    (found,) = [f for f in result.findings if "from this run on" in f.what]
    assert found.where == "run_5.csv"
    assert "from 8 runs (of the car before it was changed for run_5.csv)" in result.sentence
    assert "the result is that of the earlier runs" in found.what
