"""The road that all runs share: found from the runs, and held by the intervals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.inference.gusty import restricted_likelihood
from tests.messy_cases import estimated, prepared
from tests.plant import messy_day
from vdyn_cli.diagnosis.strategies.effect_unknowns import unknowns_of
from vdyn_cli.effects import catalog
from vdyn_cli.inference.restricted_likelihood import RandomUnknowns
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.result import FitSummary, Result
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.coastdown.fit.road_load_fit import fit_road_load
from vdyn_cli.steps.coastdown.result import with_answers
from vdyn_cli.steps.coastdown.road.shared_road import RoadLayout
from vdyn_cli.steps.road_spectrum import SPECTRA, slope_correlation

SHORT = messy_day.Day(upper=25.0, lower=5.0)
ROUGH = replace(SHORT, rms=0.0015, waves="random")
MAIN = ("rolling_resistance", "drag_area")


def covers(result: Result, case: messy_day.Case, name: str) -> bool:
    low, high = result.parameters[name].interval95
    return low <= case.truth[name] <= high


def test_an_undulating_road_is_no_gust_and_no_resistance() -> None:
    case = messy_day.drive(4, ROUGH)
    result = estimated(case, position=True)
    assert result.extra["noise"]["gust"] < 0.8  # true: 0.5 m/s
    assert result.extra["noise"]["roughness"] == pytest.approx(0.0015, rel=0.4)
    assert all(covers(result, case, name) for name in MAIN)


@pytest.mark.slow
def test_the_way_back_is_found_on_the_road_of_the_way_out() -> None:
    case = messy_day.drive(4, ROUGH)
    turn = prepared(case, position=False).problem.campaign_on_road.turn  # type: ignore[attr-defined]
    starts = {way: np.mean([r.position[0] for r in case.runs if r.direction == way]) for way in ("out", "back")}
    assert turn == pytest.approx(starts["back"] - starts["out"], abs=100.0)


@pytest.mark.slow
def test_a_level_road_widens_the_interval_a_little() -> None:
    case = messy_day.drive(4, replace(SHORT, rms=0.0))
    fit = prepared(case, position=False).problem.campaign_on_road  # type: ignore[attr-defined]
    assert fit.layout is not None
    with_road, without = fit_road_load(fit), fit_road_load(replace(fit, flat_road=True))
    assert with_road.sizes["roughness"] < 3e-4
    for name in MAIN:
        assert with_road.solution.std[name] < 1.75 * without.solution.std[name]


@pytest.mark.slow
def test_a_profile_over_the_logged_position_can_be_published() -> None:
    case = messy_day.drive(5, replace(ROUGH, rms=0.003))
    effect = next(e for e in catalog() if e.name == "grade_profile")
    problem = prepared(case, position=True).problem
    result = problem.publish(AddedEffects((effect,), unknowns_of(effect)))
    assert all(covers(result, case, name) for name in MAIN)
    assert result.extra["noise"]["roughness"] > 1e-3


def test_the_likelihood_of_a_roughness_has_the_slope_it_says() -> None:
    problem = prepared(messy_day.drive(6, ROUGH), position=True).problem
    fit = fit_road_load(problem.campaign_on_road)  # type: ignore[attr-defined]
    rows, random = fit.rows, fit.rows.random()
    assert random is not None
    start = fit.regression.start()
    noisy = [rows.noisy(k, fit.regression.local(start, k), rows.noise.at) for k in range(len(fit.regression.runs))]
    known = np.zeros(len(rows.shared))
    known[random.columns] = 1.0

    def at(shift: float) -> tuple[float, dict[str, float]]:
        sizes = {**rows.noise.sizes, "roughness": rows.noise.sizes["roughness"] * np.exp(shift)}
        return restricted_likelihood(noisy, sizes, known, RandomUnknowns("roughness", random.columns))

    by_difference = (at(1e-3)[0] - at(-1e-3)[0]) / 2e-3
    assert at(0.0)[1]["roughness"] == pytest.approx(by_difference, rel=1e-3, abs=1e-3)


@pytest.mark.parametrize("spectrum", range(len(SPECTRA)))
def test_every_spectrum_is_a_correlation(spectrum: int) -> None:
    found = slope_correlation(np.linspace(0, 2000, 60), spectrum)
    assert np.allclose(np.diag(found), 1.0)
    assert np.linalg.eigvalsh(found).min() > 0


@pytest.mark.slow
@pytest.mark.parametrize(("rms", "brake"), [(0.0, 150.0), (0.0015, 0.0)], ids=["a brake that fades", "a road"])
def test_only_what_turns_with_the_heading_is_a_road(rms: float, brake: float) -> None:
    case = messy_day.drive(4, replace(ROUGH, rms=rms, brake=brake, runs=6))
    found = prepared(case, position=False).problem.campaign_on_road.shown_roughness  # type: ignore[attr-defined]
    assert found < 4e-4 if brake else 0.001 < found < 0.003


def test_a_road_beside_effects_is_level_on_average() -> None:
    case = messy_day.drive(4, ROUGH)
    campaign = replace(prepared(case, position=False).problem.campaign, zero_mean_slope=True)  # type: ignore[attr-defined]
    layout = campaign.layout
    for profile in np.unique(layout.profile):
        assert np.abs(layout.factor[layout.profile == profile].mean(axis=0)).max() < 1e-9
    assert np.mean(np.sum(layout.factor**2, axis=1)) == pytest.approx(1.0, abs=0.1)


def test_directions_whose_overlap_is_unknown_share_the_longer_waves_of_the_road() -> None:
    knots, profile = np.tile(np.linspace(0.0, 2000.0, 48), 2), np.repeat([0, 1], 48)
    layout = RoadLayout(knots, profile, (), (), (), spectrum=3, turns=((1800.0, 0.45), (2000.0, 0.45)))
    correlation = layout.factor @ layout.factor.T
    mirrored = correlation[:48, 48:][:, ::-1]  # over the same place if the starts are 2 km apart
    assert np.all(np.diag(mirrored) < -0.6)  # half at no distance, half at 200 m of waves of 300 m
    assert np.all(np.diag(mirrored) > -0.9)
    odd = np.where(profile == 0, 1.0, -1.0)  # the slope that another effect describes
    assert np.abs(odd @ replace(layout, level=True).factor).max() < 1e-9


def test_a_published_slope_is_the_mean_slope_of_an_undulating_road() -> None:
    """A random road with its own mean slope would leave the slope of 0 open by 0.1 %, a mean of so many waves."""
    effect = next(e for e in catalog() if e.name == "road_grade")
    problem = prepared(messy_day.drive(4, ROUGH), position=True).problem
    found = problem.publish(AddedEffects((effect,), unknowns_of(effect))).amplitudes["road_grade"]
    assert abs(found.value) < 3 * found.std < 6e-4


def test_the_forces_of_open_answers_are_held() -> None:
    fit = FitSummary(runs=2, rms=0.1, unit="m/s", noise_floor=0.1, unknowns=("drag_area",))

    def at(*ends: float) -> Result:
        row = {"speed_kmh": 60.0, "force_N": 0.5 * (ends[0] + ends[1]), "interval95": list(ends)}
        return Result("coastdown", "", Parameters({}), fit, "", extra={"road_load": {"tested": 1, "force": [row]}})

    held = with_answers(at(190.0, 200.0), ((None, at(185.0, 195.0)), (None, at(198.0, 210.0)))).extra["road_load"]
    assert held["tested"] == 1
    assert held["force"][0] == {"speed_kmh": 60.0, "force_N": 195.0, "interval95": [185.0, 210.0]}


@pytest.mark.slow
def test_the_published_fit_does_not_depend_on_where_the_search_ended() -> None:
    problem = prepared(messy_day.drive(4, ROUGH), position=False).problem
    searched = problem.publish().extra["noise"]
    typical = fit_road_load(problem.campaign_on_road).sizes  # type: ignore[attr-defined]
    assert {n: searched[n] for n in typical} == pytest.approx(typical, rel=0.1)
