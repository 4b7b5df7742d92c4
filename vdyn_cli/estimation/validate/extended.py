"""Sizes of effects that the model is extended by, fitted on straight lines through themselves.

A straight line through a car with nothing wrong is too far off for a size that is large: it is laid again through what
it gave, until little moves. Play has no slope at nothing and knocks, so that lines come to rest where one knock fits
well; then they begin again where all fit best.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.estimation.validate.felt import FELT
from vdyn_cli.estimation.validate.flanks import evenly
from vdyn_cli.estimation.validate.trial import Trial
from vdyn_cli.fit import Regression, Solution, solve
from vdyn_cli.fit.straight import frozen

PASSES = 4  # of simulation and straight line
SETTLED = 0.1  # standard deviations that a further pass may move it
AGAIN = 0.4  # standard deviations that the size with which all knocks fit best may be off
FEWEST_UNITS = 8  # drives cut into windows that are units of evidence by themselves


@dataclass(frozen=True, eq=False)
class Sized:
    """What the drives make of the effects.

    Parameters
    ----------
    trial : with the effects at these sizes. solution : of the fit. straight : its regression.
    spreads : standard deviations of sizes that straight lines tell too well.
    """

    trial: Trial
    solution: Solution
    straight: Regression
    spreads: Mapping[str, float]


def sized(trial: Trial, lines: Callable[[Trial], Regression]) -> Sized:
    """The trial with its effects at the sizes that the drives give them.

    Parameters
    ----------
    lines : the regression of the drives where a trial begins.

    Raises
    ------
    ResultError : the drives do not determine them, or a simulation is not finite.
    """
    begun, solution, straight = _settled(trial, lines)
    even = evenly(begun)
    if any(abs(at - solution.values[n]) > AGAIN * std for n, (at, std) in even.items()):
        extra = tuple(replace(u, start=even[u.name][0]) if u.name in even else u for u in begun.extra)
        begun, solution, straight = _settled(replace(begun, extra=extra), lines)
        even = evenly(begun)
    spreads = {n: float(np.hypot(std, at - solution.values[n])) for n, (at, std) in even.items()}
    return Sized(replace(begun, at={}), solution, straight, spreads)


def _settled(trial: Trial, lines: Callable[[Trial], Regression]) -> tuple[Trial, Solution, Regression]:
    knocks = any(e.probes for e in trial.effects)
    for _ in range(PASSES):
        begun_at = dict(zip(trial.shared, trial.theta().tolist(), strict=True))
        before = begun_at if knocks else {u.name: u.start for u in trial.extra}
        straight = frozen(lines(trial))
        whole = FELT in trial.model.inputs and len(straight.runs) >= FEWEST_UNITS
        solution = solve(straight, units="run" if whole else "block")
        begun = trial.begun_at(solution.values) if trial.model.name == "vehicle" else trial
        trial = replace(begun, extra=tuple(replace(u, start=solution.values[u.name]) for u in trial.extra))
        if all(abs(solution.values[n] - at) < SETTLED * solution.std[n] for n, at in before.items()):
            break
    return trial, solution, straight


def fitted(trial: Trial, solution: Solution) -> Trial:
    """The extended trial with its parameters where the drives put them."""
    moved = {n: solution.values[n] for n in trial.beliefs.names}
    return replace(trial, beliefs=replace(trial.beliefs, values={**trial.beliefs.values, **moved}))
