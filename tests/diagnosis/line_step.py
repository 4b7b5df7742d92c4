"""A step whose logs are straight lines, from its description to its diagnosed result."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.diagnosis.linear import BASE, SHAPE, Campaign, cause
from vdyn_cli.description.test_description import TestSpec
from vdyn_cli.diagnosis import asked, extend, extension
from vdyn_cli.diagnosis.case import Case
from vdyn_cli.diagnosis.sizes import sizes_of
from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression, Unknown, solve
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Comparison, FitSummary, Result
from vdyn_cli.steps.contract import Diagnosable, Step, from_functions
from vdyn_cli.steps.effect_estimates import sizes_found

SLOPE, WIND, WAVE = (
    cause("slope"),
    cause("wind", lasts=False),
    cause("wave", ("wave", "wave_time"), nominal={"wave_time": 7.0}),
)


def regression(
    spec: Any, data: Campaign, known: Parameters, effects: Sequence[Any] = (), extra: Sequence[Unknown] = ()
) -> Regression:
    return data.regression(extra)


def estimate(
    spec: Any, data: Campaign, known: Parameters, effects: Sequence[Effect] = (), extra: Sequence[Unknown] = ()
) -> Result:
    solution = solve(data.regression(extra))
    found = {
        n: Estimate(solution.values[n], solution.std[n], solution.interval95[n], "m", n, "line", solution.values[n])
        for n in BASE
    }
    start = np.exp(-8 * data.x())
    comparisons = []
    for k in range(data.runs):
        simulated = start * solution.per_run["start"][k]
        for name, value in solution.values.items():
            simulated = simulated + value * data.trace(name, k)
        comparisons.append(
            Comparison(f"run {k + 1}", "height", "m", 10 * data.x(), "time, s", data.measured(k), simulated)
        )
    fit = FitSummary(tuple(c.run for c in comparisons), 1.0, 1.0, "m", tuple(BASE))
    extra_keys = sizes_found(solution, extra)
    return Result("line", "A line.", Parameters(found), fit, "Least squares.", tuple(comparisons), extra=extra_keys)


STEP = Step(
    name="line",
    spec=TestSpec,
    required=("time", "height"),
    optional=(),
    needs=(),
    gives=tuple(BASE),
    prepare=from_functions(
        estimate=estimate,
        regression=regression,
        model=lambda *_: Model("line", lambda e, u: None, (), ()),
        profiles=lambda *_: (SHAPE,),
    ),
    diagnosable=Diagnosable(
        ("height", "m"),
        two_way=lambda spec: True,
    ),
)


def spec_of(campaign: Campaign, **diagnose: Any) -> TestSpec:
    ways = ["out" if campaign.heading(k) > 0 else "back" for k in range(campaign.runs)]
    runs = [{"log": f"line_{k}.csv", "direction": way} for k, way in enumerate(ways)]
    return TestSpec.model_validate({"test": "line", "runs": runs, "diagnose": diagnose})


def diagnosed(campaign: Campaign, step: Step = STEP, level: float = 0.05, **diagnose: Any) -> tuple[Result, Result]:
    """The baseline, and the diagnosed result."""
    spec, known = spec_of(campaign, **diagnose), Parameters()
    problem = step.prepare(spec, campaign, known)
    base = problem.publish()
    return base, extend.diagnosed(step, spec, problem, known, base, level)


def unsure_sizes(answer: Any, case: Case) -> dict[str, Estimate]:
    """As the diagnosis would have them if they were hardly known."""
    return {n: replace(e, interval95=(-0.1, 1.3)) for n, e in sizes_of(answer, case).items()}


HIDDEN_SLOPE = Campaign(1, hidden={"slope": 0.6, "bend": -2.0})
HIDDEN_WIND = Campaign(1, hidden={"wind": 2.0})


def offer(monkeypatch: pytest.MonkeyPatch, *effects: Effect) -> None:
    """Let these be all the causes that there are."""
    monkeypatch.setattr(asked, "applicable", lambda model, effects_: effects)


def size(monkeypatch: pytest.MonkeyPatch, sizes_of: Callable[[Any, Case], dict[str, Estimate]]) -> None:
    """Let the diagnosis have these sizes of its causes."""
    for module in (extend, extension):
        monkeypatch.setattr(module, "sizes_of", sizes_of)
