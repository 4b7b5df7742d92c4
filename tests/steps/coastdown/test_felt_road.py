"""A coast-down with an accelerometer on an undulating road: all runs of a direction feel the same slopes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.messy_cases import prepared
from tests.plant import messy_day
from tests.plant.messy_day import Case
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.fit.road_load_fit import RoadLoadFit, fit_road_load
from vdyn_cli.steps.coastdown.step import STEP

EXACT = messy_day.Logger(noise=0.0, step=0.0)
DAY = messy_day.Day(rms=1e-3, waves="random", upper=28.0, lower=5.0, logger=EXACT)


def felt(case: Case, seed: int) -> RoadLoadFit:
    """The fit to speeds with noise of 0.03 m/s and accelerations with noise of 0.05 m/s^2 and a common zero."""
    random, logs = np.random.default_rng(seed), []
    slope = messy_day.road_of(case)
    for k, run in enumerate(case.runs, start=1):
        uphill = slope(run.position) * (1.0 if run.direction == "out" else -1.0)
        specific = np.gradient(run.speed, run.time) + GRAVITY * uphill + 0.1
        noisy = {
            "speed": run.speed + 0.03 * random.standard_normal(run.time.size),
            "acceleration": specific + 0.05 * random.standard_normal(run.time.size),
        }
        logs.append(Log(f"run_{k}.csv", run.time, noisy))
    ready = prepared(case, False)
    problem = STEP.prepare(ready.spec, tuple(logs), ready.known)
    return fit_road_load(problem.campaign_on_road)  # type: ignore[attr-defined]


@pytest.mark.slow
def test_the_slopes_that_runs_share_are_no_noise_of_each_run() -> None:
    off = []
    for seed in (1, 2, 3):
        case = messy_day.drive(seed, DAY)
        fit = felt(case, seed)
        assert 5e-4 < fit.sizes["roughness"] < 2e-3
        errors = {n: fit.solution.values[n] - case.truth[n] for n in ("rolling_resistance", "drag_area")}
        off += [error / fit.solution.std[n] for n, error in errors.items()]
    assert np.max(np.abs(off)) < 2.6


@pytest.mark.slow
def test_a_level_road_costs_little_beside_an_accelerometer() -> None:
    fit = felt(messy_day.drive(1, replace(DAY, rms=0.0)), 1)
    assert fit.sizes["roughness"] < 3e-4
