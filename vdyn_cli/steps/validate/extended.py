"""Sizes of effects that the model is extended by, fitted on straight lines through themselves.

A straight line through a car with nothing wrong is too far off for a size that is large: it is laid again through what
it gave, until little moves. Play has no slope at nothing and knocks, so that lines come to rest where one knock fits
well; then they begin again where all fit best.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.inference import Regression, Solution, solve
from vdyn_cli.inference.linearized_regression import linearized
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.validate.felt import FELT
from vdyn_cli.steps.validate.flanks import evenly
from vdyn_cli.steps.validate.trial import Trial

PASSES = 4  # of simulation and straight line
SETTLED = 0.1  # standard deviations that a further pass may move it
RESTLESS = 1.0  # standard deviations by which the last pass may move it, and no more be said
AGAIN = 0.4  # standard deviations that the size with which all knocks fit best may be off
FEWEST_UNITS = 8  # drives cut into windows that are units of evidence by themselves


@dataclass(frozen=True, eq=False)
class Sized:
    """What the drives make of the effects.

    Parameters
    ----------
    trial : with the effects at these sizes. solution : of the fit. straight : its regression.
    spreads : standard deviations of sizes that straight lines tell too well.
    moved : standard deviations by which the last pass moved the sizes.
    """

    trial: Trial
    solution: Solution
    straight: Regression
    spreads: Mapping[str, float]
    moved: float

    @property
    def doubts(self) -> tuple[Finding, ...]:
        """What is to be said of sizes that have not come to rest."""
        if self.moved < RESTLESS:
            return ()
        what = f"the causes' sizes have not come to rest: the last pass moved them by {self.moved:.1f} standard errors"
        return (Finding("fit", what, "", "take their intervals for too narrow", doubt=True),)


def sized(trial: Trial, lines: Callable[[Trial], Regression]) -> Sized:
    """The trial with its effects at the sizes that the drives give them.

    Parameters
    ----------
    lines : the regression of the drives where a trial begins.

    Raises
    ------
    ResultError : the drives do not determine them, or a simulation is not finite.
    """
    begun, solution, straight, moves = _settled(trial, lines)
    even = evenly(begun)
    if any(abs(at - solution.values[n]) > AGAIN * std for n, (at, std) in even.items()):
        extra = tuple(replace(u, start=even[u.name][0]) if u.name in even else u for u in begun.extra)
        begun, solution, straight, moves = _settled(replace(begun, extra=extra), lines)
        even = evenly(begun)
    spreads = {n: float(np.hypot(std, at - solution.values[n])) for n, (at, std) in even.items()}
    std = {**solution.std, **spreads}
    moved = max((move / std[n] for n, move in moves.items() if std[n] > 0.0), default=0.0)
    return Sized(replace(begun, at={}), solution, straight, spreads, moved)


def _settled(
    trial: Trial, lines: Callable[[Trial], Regression]
) -> tuple[Trial, Solution, Regression, Mapping[str, float]]:
    """The trial where the last line left it, that line and its fit, and by how much that still moved the sizes."""
    knocks = any(e.probes for e in trial.effects)
    for _ in range(PASSES):
        begun_at = dict(zip(trial.shared, trial.theta().tolist(), strict=True))
        straight = linearized(lines(trial))
        whole = FELT in trial.model.inputs and len(straight.runs) >= FEWEST_UNITS
        solution = solve(straight, units="run" if whole else "block")
        moves = {n: abs(solution.values[n] - at) for n, at in begun_at.items() if n in solution.values}
        sizes = {u.name: moves[u.name] for u in trial.extra}
        begun = trial.begun_at(solution.values) if trial.model.name == "vehicle" else trial
        trial = replace(begun, extra=tuple(replace(u, start=solution.values[u.name]) for u in trial.extra))
        if all(move < SETTLED * solution.std[n] for n, move in (moves if knocks else sizes).items()):
            break
    return trial, solution, straight, sizes


def fitted(trial: Trial, solution: Solution) -> Trial:
    """The extended trial with its parameters where the drives put them."""
    moved = {n: solution.values[n] for n in trial.beliefs.names}
    return replace(trial, beliefs=replace(trial.beliefs, values={**trial.beliefs.values, **moved}))
