"""Agreement of the fit with local decelerations, the force that runs share, and the influence of single runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.messy_cases import estimated, prepared
from tests.plant import messy_day
from vdyn_cli.steps.coastdown.doubts.agreement import LocalForces, influence, local_forces
from vdyn_cli.steps.coastdown.doubts.fit_quality import quality_of, unphysical
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit, fit_road_load

SHORT = messy_day.Day(rms=0.0, upper=25.0, lower=5.0)
LEVEL = {"roughness": "0 %"}


def fitted(case: messy_day.Case, position: bool = False) -> RoadLoadFit:
    return fit_road_load(prepared(case, position).problem.campaign_on_road)  # type: ignore[attr-defined]


@pytest.fixture(scope="module")
def clean() -> tuple[messy_day.Case, RoadLoadFit]:
    """A day without a disturbance, and its fit."""
    case = messy_day.drive(11, SHORT)
    return case, fitted(case)


def test_local_forces_are_those_of_the_car(clean: tuple[messy_day.Case, RoadLoadFit]) -> None:
    case, fit = clean
    found = local_forces(fit)
    assert found is not None
    truth = np.array([case.vehicle.load(float(v)) for v in found.speed])
    assert np.mean(np.abs(found.measured - truth) <= found.half) >= 0.75
    assert np.allclose(found.fitted, truth, rtol=0.06)
    assert found.excess.max() < 1.0


def test_intervals_hold_local_forces_that_disagree(clean: tuple[messy_day.Case, RoadLoadFit]) -> None:
    _, fit = clean
    value = fit.solution.values["rolling_resistance"]
    low, high = fit.solution.including({"rolling_resistance": 0.2 * value}).interval95["rolling_resistance"]
    assert low < 1.2 * value < high
    found = local_forces(fit)
    assert found is not None
    off = LocalForces(found.speed, found.measured + 3.0 * found.half, found.fitted, found.half)
    assert off.excess.max() > 1.0


@pytest.mark.slow
def test_runs_share_no_force_on_a_level_road_and_one_on_an_undulating_road() -> None:
    level = estimated(messy_day.drive(13, SHORT), position=False)
    assert all(abs(s["correlation"]) < 0.3 for s in level.extra["quality"]["shared_force"])
    assert not any("share a force" in f.what for f in level.findings)
    rough = estimated(messy_day.drive(13, replace(SHORT, rms=0.002, waves="random")), position=False)
    assert all(s["correlation"] > 0.3 for s in rough.extra["quality"]["shared_force"])
    (shared,) = [f for f in rough.findings if "share a force" in f.what]
    assert "position" in shared.remedy
    assert "if it is the road" in shared.what


def test_influence_is_that_of_fits_without_the_run() -> None:
    case = messy_day.drive(14, replace(SHORT, runs=6))
    problem = prepared(case, False, road=LEVEL).problem
    full = fit_road_load(problem.campaign_on_road)  # type: ignore[attr-defined]
    shifts = influence(full)
    for k, run in enumerate(full.campaign.runs):
        keep = [i for i in range(6) if i != k]
        campaign = replace(
            full.campaign,
            runs=tuple(full.campaign.runs[i] for i in keep),
            levels=tuple(full.campaign.levels[i] for i in keep),
        )
        rest = fit_road_load(campaign, rounds=0)
        for name, shift in shifts[run.name].items():
            moved = rest.solution.values[name] - full.solution.values[name]
            assert shift == pytest.approx(moved, abs=0.35 * full.solution.std[name])


def test_a_disturbed_run_has_the_largest_influence() -> None:
    case = messy_day.drive(15, replace(SHORT, runs=6))
    disturbed = replace(case.runs[2], speed=case.runs[2].speed * np.linspace(1.0, 1.25, case.runs[2].speed.size))
    case = replace(case, runs=(*case.runs[:2], disturbed, *case.runs[3:]))
    result = estimated(case, position=False)
    shifts = result.extra["quality"]["influence"]
    worst = max(shifts, key=lambda run: abs(shifts[run]["rolling_resistance"]))
    assert worst == "run_3.csv"


@pytest.mark.parametrize("seed", [31, *(pytest.param(n, marks=pytest.mark.slow) for n in (32, 33))])
def test_runs_of_a_day_without_a_disturbance_are_not_named(seed: int) -> None:
    found = quality_of(fitted(messy_day.drive(seed, replace(SHORT, runs=4)))).findings()
    assert not [f for f in found if f.doubt and "without this run" in f.what]


def test_a_disturbed_run_is_named() -> None:
    case = messy_day.drive(15, replace(SHORT, runs=6))
    run = case.runs[2]
    slow = replace(run, speed=run.speed - 0.02 * (run.time - run.time[0]))
    found = quality_of(fitted(replace(case, runs=(*case.runs[:2], slow, *case.runs[3:])))).findings()
    assert {f.where for f in found if f.doubt and "without this run" in f.what} == {"run_3.csv"}


@pytest.mark.slow
def test_gusts_beyond_any_test_day_are_a_finding_and_no_noise() -> None:
    stormy = messy_day.drive(16, replace(SHORT, weather=messy_day.Weather(gust=4.0, drift=0.0)))
    fit = fitted(stormy)
    assert "gust" in unphysical(fit)
    assert any(f.doubt and "gusts" in f.what for f in quality_of(fit).findings())
