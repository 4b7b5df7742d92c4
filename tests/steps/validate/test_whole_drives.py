"""Drives cut into segments by stops: their segments share one wind, and the drive is the run of the regression."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.bench.diagnose_first_validate import description
from tests.plant import light_ev
from vdyn_cli.diagnosis.detect.scores import scores
from vdyn_cli.diagnosis.strategies.effect_unknowns import unknowns_of
from vdyn_cli.diagnosis.strategies.linearized_system import initial_values, linearize, linearized_system
from vdyn_cli.effects import catalog
from vdyn_cli.project.inputs import gather
from vdyn_cli.steps import load_step
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.validate.fit.whitening import whiten_drives
from vdyn_cli.steps.validate.fit.whole_drives import is_cut, whole_drives
from vdyn_cli.steps.validate.problem import ValidateProblem

STEP = load_step("validate")


def in_town(folder: Path, runs: int, seconds: float) -> ValidateProblem:
    """Drives of a light electric vehicle through a town."""
    found = gather(STEP, description(folder, 101, {}, runs, seconds))
    return ValidateProblem(found.spec, found.data, found.known)


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> ValidateProblem:
    return in_town(tmp_path_factory.mktemp("town"), 4, 60.0)


def test_the_runs_are_the_drives_not_their_segments(town: ValidateProblem) -> None:
    assert is_cut(town.baseline)
    assert len(town.baseline.segments) == 6
    assert [Path(n).stem for n in whole_drives(town.baseline).runs] == ["run_1", "run_2", "run_3", "run_4"]


def test_a_segment_alone_has_the_noise_that_it_had(town: ValidateProblem) -> None:
    """Steady sources are separate from the factor: f f' + s s' is the covariance with everything in the factor."""
    together = whiten_drives(town.baseline, averaged=True).whitenings
    apart = whiten_drives(town.baseline, averaged=True, steady_apart=True).whitenings
    for whole, one in zip(together, apart, strict=True):
        covariance = one.factor @ one.factor.T + one.steady @ one.steady.T
        np.testing.assert_allclose(covariance, whole.factor @ whole.factor.T, rtol=1e-9, atol=1e-12)


def test_rows_are_linear_in_what_lasts_for_a_drive(town: ValidateProblem) -> None:
    regression = whole_drives(town.baseline)
    theta = regression.local(regression.start(), 0)
    moved = theta.copy()
    moved[-len(regression.own) :] += np.arange(1.0, 1.0 + len(regression.own))
    first, second = regression.rows(0, theta), regression.rows(0, moved)
    np.testing.assert_allclose(second.residual - first.residual, first.jacobian @ (moved - theta), atol=1e-9)
    assert first.plain is not None
    assert second.plain is not None
    np.testing.assert_allclose(second.plain[0] - first.plain[0], first.plain[1] @ (moved - theta), atol=1e-9)


def test_four_drives_hold_four_winds_however_often_they_stop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(light_ev, "Logger", partial(light_ev.Logger, gust=0.02, wind=0.5))
    baseline = in_town(tmp_path, 4, 120.0).baseline
    assert len(baseline.segments) > 8
    headwind = next(e for e in catalog() if e.name == "headwind")
    setup = baseline.with_effects(AddedEffects((headwind,), unknowns_of(headwind, prior=True)))
    regression = whole_drives(setup)
    system = linearized_system(linearize(regression, {}, initial_values(regression)))
    known = [u.name for u in regression.shared if u.name not in headwind.unknowns]
    (spread,) = scores(system, known, {"headwind": tuple(headwind.unknowns)}).spread["headwind"]
    wind = whiten_drives(setup, averaged=True).sizes["run_wind"]
    assert spread > 0.9 * wind / np.sqrt(4)  # the noise model's response to a wind is that of bins of the speed
