"""Which effects a set of runs would detect and discriminate, and which runs to add, from the Cramer-Rao bound."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import nan, sqrt

import numpy as np

from vdyn_cli.diagnosis.detect.detectability import detectable, lacking_channels, untestable
from vdyn_cli.diagnosis.detect.detection import detect, fewest_runs, obstacle
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep, setup_of
from vdyn_cli.diagnosis.next_tests.experiment_design import Contrast, ExperimentDesigner, typical_contrast
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.full_model import FittedModel
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.quantities.diagnosis import Detectable, NotTestable
from vdyn_cli.quantities.plan_schema import AddedRuns, Separation
from vdyn_cli.steps.manoeuvre import Manoeuvre

LISTED = 4  # manoeuvres that are listed

Question = tuple[tuple[str, ...], tuple[Contrast, ...]]  # effects, and the contrasts that separate them


@dataclass(frozen=True)
class ExpectedInformation:
    """The expected information of planned runs.

    Parameters
    ----------
    detectable : the smallest amplitude of each candidate that the runs reveal. not_testable : candidates without one.
    confused : pairs of effects that are each detected but not discriminated.
    added : what further runs would add.
    spread : standard error of each unknown of the baseline.
    """

    detectable: tuple[Detectable, ...]
    not_testable: tuple[NotTestable, ...]
    confused: tuple[Separation, ...]
    added: tuple[AddedRuns, ...]
    spread: Mapping[str, float]


def expected_information(prepared: PreparedStep, runs: int) -> ExpectedInformation:
    """The information of ``runs`` runs like those in the problem, and what further runs would add.

    Assumes the noise of the problem's logs and a model without effects.

    Raises
    ------
    ResultError : the baseline cannot be fitted.
    """
    strategy = open_strategy(setup_of(prepared))
    model = strategy.model
    designer = ExperimentDesigner(strategy, runs / model.run_count)
    base = _repeated(strategy.base, runs / model.run_count)
    found = detect(strategy, base)
    undetectable = list(untestable(model, base, found.scores))
    if runs >= fewest_runs(POLICY.level):
        undetectable = [u for u in undetectable if obstacle(model, found.scores, u.effect) != "runs"]
    if runs < model.setup.fewest_runs:
        few = f"{runs} {model.setup.run}{'s are' if runs > 1 else ' is'} too few for a diagnosis"
        few += f" (needed: {model.setup.fewest_runs})"
        undetectable += [NotTestable(effect=n, because=few, size=nan, unit="", would_bias={}) for n in found.testable]
        found = replace(found, testable=())
    single = [n for n in model.setup.candidates if len(model.amplitudes(n)) == 1]

    def contrast(effect: str, *beside: str) -> Contrast:
        return typical_contrast(model, effect, beside)

    revealed = [
        n for n in found.testable if n in single and designer.driven_separation([contrast(n)]) >= POLICY.separated_t
    ]
    pairs: list[Question] = [((a, b), (contrast(a, b), contrast(b, a))) for a, b in combinations(revealed, 2)]
    apart = [(pair, designer.driven_separation(pair[1])) for pair in pairs]
    confused = sorted(((p, t) for p, t in apart if t < POLICY.separated_t), key=lambda pair: pair[1])
    unseen: list[Question] = [((u.effect,), (contrast(u.effect),)) for u in undetectable if u.effect in single]
    return ExpectedInformation(
        detectable(model, base, found),
        (*undetectable, *lacking_channels(model.setup)),
        tuple(Separation(effects=list(effects), t=t) for (effects, _), t in confused),
        _added(designer, [*(pair for pair, _ in confused), *unseen]),
        designer.spread(),
    )


def _repeated(base: FittedModel, times: float) -> FittedModel:
    """The fitted baseline with every run repeated ``times`` times: sensitivities of its rows grow with the root."""
    system = base.system
    of_runs = (system.run[system.label] >= 0)[:, None]
    return replace(base, system=replace(system, columns=np.where(of_runs, sqrt(times), 1.0) * system.columns))


def _added(designer: ExperimentDesigner, questions: Sequence[Question]) -> tuple[AddedRuns, ...]:
    """The information added by each manoeuvre of the step, and by repeating the same runs."""
    model = designer.strategy.model
    again = Manoeuvre(
        lambda runs: f"{runs} more {model.setup.run}{'' if runs == 1 else 's'} of the same kind",
        lambda: model.regression,
        round(designer.times * model.run_count),
        1,
    )
    return tuple(_added_by(designer, one, questions) for one in (*designer.manoeuvres[:LISTED], again))


def _added_by(designer: ExperimentDesigner, one: Manoeuvre, questions: Sequence[Question]) -> AddedRuns:
    """The fewest runs of a manoeuvre that separate any of the effects, or one set of runs where none does."""
    answers: list[Separation] = []
    for times in range(1, one.most + 1):
        rows = designer.after(one, times)
        found = [(effects, designer.separation(rows, contrasts)) for effects, contrasts in questions]
        answers = [Separation(effects=list(effects), t=t) for effects, t in found if t >= POLICY.separated_t]
        if answers:
            break
    times = times if answers else 1
    rows = designer.after(one, times)
    std = {n: s for n, s in designer.spread(rows).items() if n not in designer.strategy.model.nuisances}
    return AddedRuns(manoeuvre=one.words(times * one.each), runs=times * one.each, separates=answers, std=std)
