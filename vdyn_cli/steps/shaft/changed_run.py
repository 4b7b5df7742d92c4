"""Finds the run with another stiffness than the other runs of one half-shaft."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from vdyn_cli.inference import Solution, even_if_refused
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.shaft.policy import SHAFT_POLICY
from vdyn_cli.steps.shaft.shaft_fit import linear_solution, noise_excess
from vdyn_cli.steps.shaft.shaft_readings import ShaftReadings


@dataclass(frozen=True)
class ChangedRun:
    """The finding that runs of one half-shaft have different stiffnesses.

    Parameters
    ----------
    finding : names the run that differs from the others, or all runs.
    span : N m/rad, of the 95 % intervals of the different stiffnesses.
    """

    finding: Finding
    span: tuple[float, float]


def changed_run(runs: Sequence[ShaftReadings], together: Solution) -> ChangedRun | None:
    """The run which alone has another stiffness; None where the linear law fits all runs, or not even each one.

    A law that is not linear (backlash, a progressive joint) does not fit each run to its noise either, so that it is
    not taken for a change of the shaft.

    Parameters
    ----------
    runs : of one half-shaft. together : the fit to all of them.

    Raises
    ------
    ResultError : a fit to some of the runs fails.
    """
    if len(runs) < 2 or not _excessive(together, runs):
        return None
    alone = [_fit([run]) for run in runs]
    if any(_excessive(solution, [run]) for solution, run in zip(alone, runs, strict=True)):
        return None
    remedy = "check shaft and torque sensor in that run; remove the run, or describe it as a test of its own"
    for k, run in enumerate(runs if len(runs) > 2 else ()):
        others = [*runs[:k], *runs[k + 1 :]]
        rest = _fit(others)
        if not _excessive(rest, others):
            here, there = _stiffness(alone[k]), _stiffness(rest)
            what = f"stiffness {here:.0f} N m/rad in this run, {there:.0f} N m/rad in the {len(others)} others together"
            off = f"{100 * (here / there - 1):+.1f} %"
            return ChangedRun(Finding(run.name, what, off, remedy, fault=True, doubt=True), _span([alone[k], rest]))
    each = ", ".join(f"{run.name} {_stiffness(s):.0f} N m/rad" for run, s in zip(runs, alone, strict=True))
    what = "each fits a linear shaft, but with another stiffness"
    return ChangedRun(Finding("runs", what, each, remedy, doubt=True), _span(alone))


def _fit(runs: Sequence[ShaftReadings]) -> Solution:
    return even_if_refused(partial(linear_solution, runs))


def _excessive(solution: Solution, runs: Sequence[ShaftReadings]) -> bool:
    return noise_excess([solution], runs) > SHAFT_POLICY.shaft_excess


def _stiffness(solution: Solution) -> float:
    return solution.values["shaft_stiffness"]


def _span(solutions: Sequence[Solution]) -> tuple[float, float]:
    """The range of the 95 % intervals of several stiffnesses, N m/rad."""
    low, high = zip(*(s.interval95["shaft_stiffness"] for s in solutions), strict=True)
    return min(low), max(high)
