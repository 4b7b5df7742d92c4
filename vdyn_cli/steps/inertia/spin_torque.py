"""Net torque in the windows of a wheel's moment balance at a solution: from the wheel's speed, and at the hub."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.result import Comparison, FitSummary
from vdyn_cli.steps.fit_outcome import fit_summary
from vdyn_cli.steps.inertia.moment_balance import MomentBalance


def spin_torques(balance: MomentBalance, solution: Solution) -> tuple[tuple[Comparison, ...], FitSummary]:
    """For each run, the mean net torque in its windows (w,), N m, and the summary of the balance's fit in N m.

    Measured: inertia times the mean angular acceleration. Simulated: from torque and forces at the hub.
    """
    inertia, torques, noise = solution.values["wheel_inertia"], list[Comparison](), list[Array]()
    for run, white in zip(balance.runs, solution.residuals, strict=True):
        factor = run.noise.factor(inertia, balance.moment)
        excess = factor[0] * white
        excess[1:] += factor[1, :-1] * white[:-1]
        measured = inertia * run.gained / run.duration
        simulated = measured + excess / run.duration
        torques.append(Comparison(run.log.name, "spin torque", "N m", run.middle, "time in s", measured, simulated))
        noise.append(np.sqrt(run.noise.variance(inertia, balance.moment)) / run.duration)
    left = [c.measured - c.simulated for c in torques]
    summary = fit_summary(solution, (c.run for c in torques), left, noise, "N m")
    return tuple(torques), replace(summary, unknowns=(*solution.names, *solution.per_run))
