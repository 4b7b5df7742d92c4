"""Planned manoeuvres: the expected separation agrees with that of logs from the independent plant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from tests.bench import cases
from tests.diagnosis.linear import CATALOG, Campaign, cause
from tests.plant import coast
from tests.plant.coast_information import information
from tests.plant.information import total
from tests.plant.vehicle import Vehicle, random_vehicle
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep, setup_of
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name.candidate_judgment import judge
from vdyn_cli.diagnosis.next_tests.experiment_design import Contrast, ExperimentDesigner, PlannedTest
from vdyn_cli.diagnosis.next_tests.next_test import next_tests
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.inference import Regression, Rows
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.diagnosis import NextTest
from vdyn_cli.steps import load_step
from vdyn_cli.steps.manoeuvre import Manoeuvre

Driven = Sequence[tuple[int, coast.Day]]  # seed of each day's logs, and how it was driven
CHANNELS = {name: cases.COAST_CHANNELS[name] for name in ("time", "speed")}
BASE = ("rolling_resistance", "drag_area")
SHORT = coast.DAY.but(rate=5.0)
SEEDS = (1, 2, 3)


def bench(vehicle: Vehicle, days: Driven, hidden: Mapping[str, float], folder: Path, fixed: bool = False) -> Strategy:
    """The strategy of logs on disk, one day's runs after the other's."""
    runs: list[coast.Run] = []
    for seed, day in days:
        after = runs[-1].start + 300.0 if runs else 0.0
        runs += [replace(r, start=r.start + after) for r in coast.campaign(vehicle, seed, day, hidden)]
    notes = [{"direction": r.direction, "start": r.start} for r in runs]
    settings = {"fix": {"drag_coefficient": vehicle.drag_coefficient}} if fixed else {}
    known = coast.known(vehicle, days[0][1])
    path = cases.write(folder, "coastdown", known, CHANNELS, [r.record for r in runs], notes, settings=settings)
    step = load_step("coastdown")
    inputs = gather(step, path)
    problem = step.prepare(inputs.spec, inputs.data, inputs.known)
    return open_strategy(setup_of(PreparedStep(step, inputs.spec, inputs.known, problem)))


def beside(of: Strategy, hidden: Mapping[str, float], rival: str) -> tuple[Contrast, ...]:
    return (Contrast(hidden, (*of.model.base_unknowns, *of.model.amplitudes(rival))),)


def least(vehicle: Vehicle, days: Driven, hidden: Mapping[str, float], *names: str) -> dict[str, float]:
    """The plant's Cramer-Rao bounds of effects that are fitted together, over all days."""
    parts = [information(vehicle, seed, day, hidden, names) for seed, day in days]
    return total([p.reduced([*BASE, *names]) for p in parts]).bound()


HIDDEN = {"headwind": 1.0, "speed_dependent_rolling": 2e-4}


@cache
def promised(seed: int, name: str, rival: str) -> PlannedTest:
    """The manoeuvre planned to discriminate a hidden effect from a rival, after the coasts of a short day."""
    with TemporaryDirectory() as folder:
        made = bench(random_vehicle(seed), [(seed, SHORT)], {name: HIDDEN[name]}, Path(folder))
    plan = ExperimentDesigner(made).best(beside(made, {name: HIDDEN[name]}, rival))
    assert plan is not None
    assert plan.t >= POLICY.separated_t
    assert "to 7 km/h" in plan.text
    return plan


def with_it(seed: int, plan: PlannedTest) -> Driven:
    """The logs of the short day, and of the driven manoeuvre."""
    wide = SHORT.but(start_speed=1.3 * SHORT.start_speed, end_speed=2.0, runs=plan.runs)
    return [(seed, SHORT), (seed + 500, wide)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "rival"),
    [
        pytest.param("headwind", "road_grade", marks=pytest.mark.thorough),
        ("speed_dependent_rolling", "brake_drag_fading"),
    ],
    ids=["wind against slope", "tires against brakes"],
)
def test_what_is_promised_is_what_the_plant_says_of_driving_it(name: str, rival: str) -> None:
    """The noise is estimated from few runs, so that the median of several predictions is tested."""
    ratios = []
    for seed in SEEDS:
        plan, size = promised(seed, name, rival), HIDDEN[name]
        bound = least(random_vehicle(seed), with_it(seed, plan), {name: size}, name, rival)[name]
        ratios.append(plan.t * bound / size)
    assert median(ratios) == pytest.approx(1.0, abs=0.25)
    assert all(0.5 < ratio < 2.0 for ratio in ratios)


@pytest.mark.slow
@pytest.mark.thorough
def test_the_logs_of_the_manoeuvre_tell_as_much(tmp_path: Path) -> None:
    """The manoeuvre is driven by the plant, logged, read and fitted together with the first runs."""
    ratios = []
    for seed in SEEDS:
        plan, hidden = promised(seed, "headwind", "road_grade"), {"headwind": HIDDEN["headwind"]}
        later = bench(random_vehicle(seed), with_it(seed, plan), hidden, tmp_path)
        ratios.append(plan.t / ExperimentDesigner(later).driven_separation(beside(later, hidden, "road_grade")))
    assert median(ratios) == pytest.approx(1.0, abs=0.25)


def told(of: Strategy) -> tuple[Judgment, tuple[NextTest, ...]]:
    verdict = judge(of)
    return verdict, next_tests(of, verdict)


@pytest.mark.slow
def test_rivals_are_separated_once_it_is_driven(tmp_path: Path) -> None:
    vehicle, hidden = random_vehicle(1), {"headwind": 2.0}
    narrow = SHORT.but(runs=6, start_speed=24.0, end_speed=15.0)
    verdict, (first, *others) = told(bench(vehicle, [(1, narrow)], hidden, tmp_path))
    assert verdict.verdict == "ambiguous"
    assert set(first.separates) == {"headwind", "road_grade"}
    assert "113 to 7 km/h" in first.manoeuvre
    assert first.runs is not None
    assert first.expected_t is not None
    assert first.expected_t >= POLICY.separated_t
    assert [t.expected_t for t in others] == [None, None]  # what confirms the one, and the other
    wide = narrow.but(start_speed=1.3 * 24.0, end_speed=2.0, runs=first.runs)
    settled = judge(bench(vehicle, [(1, narrow), (501, wide)], hidden, tmp_path))
    assert settled.verdict == "named"
    assert settled.answer is not None
    assert settled.answer.effects == ("headwind",)


@pytest.mark.slow
def test_drag_that_the_baseline_calls_its_own_is_promised_to_nobody(tmp_path: Path) -> None:
    made = bench(random_vehicle(1), [(1, SHORT)], {}, tmp_path)
    verdict, tests = told(made)
    assert "extra_drag_area" in {i.effect for i in verdict.untestable}
    base = [Contrast({"extra_drag_area": 0.3}, made.model.base_unknowns)]
    plan = ExperimentDesigner(made).best(base)
    assert plan is not None
    assert plan.t < 0.1
    hopeless = [t for t in tests if "No coast-down can detect it" in t.manoeuvre]
    assert hopeless
    assert all(t.expected_t is None for t in hopeless)
    reached = [float(t.manoeuvre.split("can detect it (")[1].split(" ")[0]) for t in hopeless]
    assert max(reached) < 1.0  # the road's prior leaves them a little that the road load does not imitate


def test_with_the_drag_known_it_is_promised(tmp_path: Path) -> None:
    made = bench(random_vehicle(1), [(1, SHORT)], {}, tmp_path, fixed=True)
    assert "drag_area" not in made.model.base_unknowns
    plan = ExperimentDesigner(made).best([Contrast({"extra_drag_area": 0.1}, made.model.base_unknowns)])
    assert plan is not None
    assert plan.t >= POLICY.separated_t


@pytest.mark.slow
def test_for_runs_in_one_direction_the_gain_by_two_coasts_is_reported(tmp_path: Path) -> None:
    vehicle, day = random_vehicle(1), SHORT.but(one_way=True)
    verdict, (first, second) = told(bench(vehicle, [(1, day)], {}, tmp_path))
    assert verdict.verdict == "not_testable"
    assert first.expected_t is None
    assert second.runs == 2
    assert second.expected_t is not None
    bound = least(vehicle, [(1, day), (500, SHORT.but(runs=2))], {}, "headwind", "road_grade")
    half = {"headwind": 4.0, "road_grade": 0.015}  # of what is plausible
    assert second.expected_t == pytest.approx(min(half[n] / bound[n] for n in half), rel=0.25)


# On straight lines, whose answers are known -------------------------------------------------------------------------

SLOPE, WIND = cause("slope"), cause("wind")


def lines(traces: Mapping[str, float], each: int = 2, most: int = 10) -> Manoeuvre:
    """Runs of one row each, with these sensitivities."""

    def regression() -> Regression:
        whole = Campaign(2, runs=4).setup(SLOPE, WIND)
        full = open_strategy(whole).model.regression
        row = np.array([[traces.get(u.name, 0.0) for u in (*full.shared, *full.own)]])
        runs = tuple(f"run {k}" for k in range(each))
        return replace(full, runs=runs, rows=lambda run, theta: Rows(np.zeros(1), row))

    return Manoeuvre(lambda runs: f"{runs} lines showing {'+'.join(traces)}", regression, each, most)


def designed(*manoeuvres: Manoeuvre) -> ExperimentDesigner:
    case = Campaign(2, runs=4, hidden={"slope": 0.2}).setup(SLOPE, WIND)
    return ExperimentDesigner(open_strategy(replace(case, manoeuvres=lambda full, values: manoeuvres)))


def test_information_adds_up_over_runs() -> None:
    designer = designed(lines({"slope": 3.0}))
    asked = [Contrast({"slope": 0.2}, (*designer.strategy.model.base_unknowns, "wind"))]
    now, plan = designer.driven_separation(asked), designer.best(asked)
    assert plan is not None
    assert plan.t == pytest.approx(np.sqrt(now**2 + plan.runs * (3.0 * 0.2) ** 2), rel=1e-6)


def test_the_fewest_runs_win_and_then_the_least_effort() -> None:
    slow, fast, dear = lines({"slope": 8.0}), lines({"slope": 30.0}), lines({"slope": 40.0})
    asked = [Contrast({"slope": 0.2}, ("level", "bend", "wind"))]
    plan = designed(slow, fast, dear).best(asked)
    assert plan is not None
    assert plan.manoeuvre is fast
    assert plan.runs == 2


def test_where_no_test_suffices_the_best_is_reported() -> None:
    asked = [Contrast({"slope": 0.2}, ("level", "bend", "wind"))]
    poor, better = lines({"slope": 0.1}), lines({"slope": 5.0}, most=1)
    plan = designed(poor, better).best(asked)
    assert plan is not None
    assert plan.manoeuvre is better
    assert plan.t < POLICY.separated_t


def test_what_is_another_on_another_day_tells_nothing_of_this_one() -> None:
    same, other = lines({"slope": 8.0}), replace(lines({"slope": 8.0}), anew=frozenset({"slope"}))
    designer = designed(other)
    asked = [Contrast({"slope": 0.2}, ("level", "bend", "wind"))]
    plan = designer.best(asked)
    assert plan is not None
    assert plan.t == pytest.approx(designer.driven_separation(asked))
    settled = designed(same).best(asked)
    assert settled is not None
    assert settled.t >= POLICY.separated_t


def test_nothing_is_simulated_for_a_question_that_is_not_asked() -> None:
    def never() -> Regression:
        raise AssertionError("simulated in vain")

    case = Campaign(7, runs=2, hidden={"wind": 5.0}).setup(SLOPE, WIND, fewest_runs=4)
    made = open_strategy(replace(case, manoeuvres=lambda full, values: (Manoeuvre(str, never),)))
    verdict, tests = told(made)
    assert verdict.verdict == "not_testable"
    assert [t.expected_t for t in tests] == [None]


def test_rivals_that_more_runs_would_part_are_promised_so() -> None:
    case = Campaign(2, runs=4, hidden={"slope": 0.2}).setup(SLOPE, WIND)
    bench = open_strategy(case)
    verdict = judge(bench)
    assert verdict.verdict == "ambiguous"
    more = [t for t in next_tests(bench, verdict) if t.runs is not None]
    assert set(more[0].separates) == {"slope", "wind"}
    expected, runs = more[0].expected_t, more[0].runs
    assert expected is not None
    assert runs is not None
    assert expected == pytest.approx(6.0, abs=0.4)
    assert str(runs) in more[0].manoeuvre
    base = Campaign(2, runs=4 + runs, hidden={"slope": 0.2}).setup(SLOPE, WIND)
    later = judge(open_strategy(base))
    assert later.verdict == "named"


def test_rivals_with_the_same_trace_need_another_manoeuvre() -> None:
    case = Campaign(2, hidden={"wind": 2.0}).setup(*CATALOG, cause("wind_twin"))
    bench = open_strategy(case)
    tests = next_tests(bench, judge(bench))
    assert {t.manoeuvre for t in tests} <= {"Show the wind alone.", "Show the wind_twin alone."}
    assert all(t.runs is None for t in tests)
