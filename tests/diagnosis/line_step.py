"""A step whose logs are straight lines, from its description to its diagnosed result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

from tests.diagnosis.linear import BASE, SHAPE, Campaign, cause
from vdyn_cli.description.description_model import Description
from vdyn_cli.diagnosis import diagnose, diagnosis_setup
from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup, PreparedStep
from vdyn_cli.diagnosis.extend import extension
from vdyn_cli.diagnosis.extend.amplitudes import fitted_amplitudes
from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression, Unknown, solve
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.quantities.result import Comparison, FitSummary, Result
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.contract import NO_VALUES
from vdyn_cli.steps.effect_estimates import effect_amplitudes
from vdyn_cli.steps.manoeuvre import Manoeuvre
from vdyn_cli.steps.step_definition import Diagnosable, Step

NOTHING_KNOWN = Parameters()
SLOPE, WIND, WAVE = (
    cause("slope", turns=True),
    cause("wind", lasts=False, turns=True),
    cause("wave", ("wave", "wave_time"), nominal={"wave_time": 7.0}),
)


def estimate(data: Campaign, added: AddedEffects = NO_EFFECTS) -> Result:
    solution = solve(data.regression(added.unknowns))
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
    amplitudes = effect_amplitudes(solution, added.unknowns)
    fit = FitSummary(tuple(c.run for c in comparisons), 1.0, 1.0, "m", tuple(BASE))
    return Result(
        "line", "A line.", Parameters(found), fit, "Least squares.", tuple(comparisons), amplitudes=amplitudes
    )


@dataclass(frozen=True)
class LineProblem:
    """Straight lines, prepared from a campaign; ``estimated`` computes its result."""

    data: Campaign
    estimated: Callable[[Campaign, AddedEffects], Result] = estimate
    model: Model = field(default_factory=lambda: Model("line", lambda e, u: None, (), ()))
    profiles: tuple[Effect, ...] = (SHAPE,)
    has_further_numbers: bool = False

    def regression(self, added: AddedEffects = NO_EFFECTS, start: Mapping[str, float] = NO_VALUES) -> Regression:
        return self.data.regression(added.unknowns)

    def chord_regression(self, added: AddedEffects, start: Mapping[str, float]) -> Regression:
        return self.regression(added, start)

    def publish(self, added: AddedEffects = NO_EFFECTS) -> Result:
        return self.estimated(self.data, added)

    def directions(self, stated: Sequence[str | None]) -> Sequence[str | None]:
        return stated

    def including(self, result: Result, answers: Sequence[tuple[float | None, Result]]) -> Result:
        return result

    def derived(self, values: Mapping[str, float]) -> Mapping[str, float]:
        return {}

    def likely_size(self, effect: Effect, start: Callable[[float], tuple[Unknown, ...]]) -> None:
        return None

    def plans(self, regression: Regression, values: Mapping[str, float]) -> tuple[Manoeuvre, ...]:
        return ()


STEP = Step(
    name="line",
    spec=Description,
    required=("time", "height"),
    optional=(),
    needs=(),
    gives=tuple(BASE),
    extra_channels=(Quantity("height", "m", "height of the line"),),
    prepare=lambda spec, data, known: LineProblem(data),
    diagnosable=Diagnosable(("height", "m"), two_way=lambda spec: True),
)


def publishing(estimated: Callable[[Campaign, AddedEffects], Result]) -> Step:
    """The step whose problems publish the result of ``estimated``."""
    return replace(STEP, prepare=lambda spec, data, known: LineProblem(data, estimated))


def prepared(
    spec: Description, campaign: Campaign, step: Step = STEP, known: Parameters = NOTHING_KNOWN
) -> PreparedStep:
    return PreparedStep(step, spec, known, step.prepare(spec, campaign, known))


def spec_of(campaign: Campaign, **diagnose: Any) -> Description:
    ways = ["out" if campaign.heading(k) > 0 else "back" for k in range(campaign.runs)]
    runs = [{"log": f"line_{k}.csv", "direction": way} for k, way in enumerate(ways)]
    return Description.model_validate({"test": "line", "runs": runs, "diagnose": diagnose})


def diagnosed(campaign: Campaign, step: Step = STEP, level: float = 0.05, **requested: Any) -> tuple[Result, Result]:
    """The baseline, and the diagnosed result."""
    made = prepared(spec_of(campaign, **requested), campaign, step)
    base = made.problem.publish()
    return base, diagnose.diagnosed(made, base, level)


def unsure_sizes(answer: Any, case: DiagnosisSetup) -> dict[str, Estimate]:
    """Amplitudes as the diagnosis gives them, with very large standard deviations."""
    return {n: replace(e, interval95=(-0.1, 1.3)) for n, e in fitted_amplitudes(answer, case).items()}


HIDDEN_SLOPE = Campaign(1, hidden={"slope": 0.6, "bend": -2.0})
HIDDEN_WIND = Campaign(1, hidden={"wind": 2.0})


def offer(monkeypatch: pytest.MonkeyPatch, *effects: Effect) -> None:
    """Replace the catalog by these effects."""
    monkeypatch.setattr(diagnosis_setup, "applicable", lambda model, effects_: effects)


def size(
    monkeypatch: pytest.MonkeyPatch, fitted_amplitudes: Callable[[Any, DiagnosisSetup], dict[str, Estimate]]
) -> None:
    """Replace the fitted amplitudes by these."""
    for module in (diagnose, extension):
        monkeypatch.setattr(module, "fitted_amplitudes", fitted_amplitudes)
