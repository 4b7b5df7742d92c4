"""Net torque in the windows of a wheel's moment balance at a solution: from the wheel's speed, and at the hub."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.quantities.result import Comparison, FitSummary
from vdyn_cli.steps.fit_outcome import fit_summary
from vdyn_cli.steps.inertia.moment_balance import MomentBalance


def spin_torques(balance: MomentBalance, solution: Solution) -> tuple[Comparison, ...]:
    """For each run, the mean net torque in its windows (w,), N m.

    Measured: inertia times the mean angular acceleration. Simulated: from torque and forces at the hub.
    """
    inertia, found = solution.values["wheel_inertia"], []
    for run, white in zip(balance.runs, solution.residuals, strict=True):
        factor = run.noise.factor(inertia, balance.moment)
        excess = factor[0] * white
        excess[1:] += factor[1, :-1] * white[:-1]
        measured = inertia * run.gained / run.duration
        simulated = measured + excess / run.duration
        found.append(Comparison(run.log.name, "spin torque", "N m", run.middle, "time in s", measured, simulated))
    return tuple(found)


def torque_summary(balance: MomentBalance, solution: Solution, torques: Sequence[Comparison]) -> FitSummary:
    """The summary of the balance's fit, in N m of ``spin_torques``."""
    inertia = solution.values["wheel_inertia"]
    noise = [np.sqrt(run.noise.variance(inertia, balance.moment)) / run.duration for run in balance.runs]
    summary = fit_summary(solution, (c.run for c in torques), [c.measured - c.simulated for c in torques], noise, "N m")
    return replace(summary, unknowns=(*solution.names, *solution.per_run))
