"""Sensitivity of the result to the known numbers: masses, inertia, lengths, and the bump's size."""

from __future__ import annotations

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.physics.models.half_car import GIVEN, SOUGHT
from vdyn_cli.steps.bump.half_car_fit import BumpFit, BumpRows

NOT_LISTED = ("antenna_offset", "outboard_mass")  # zero in most tests, so that a relative change has no meaning


def sensitivity_to_known(fit: BumpFit, solution: Solution) -> dict[str, dict[str, float]]:
    """Total derivatives d sought / d known at the solution, by known number, including changes of other unknowns.

    With J the whitened derivatives by all unknowns, P the priors' weights and d the derivatives by a known number,
    slope = -(J'J + P)^-1 J'd; where the number is itself an unknown with a prior, (J'J + P)^-1 P.
    """
    s, m, g = len(fit.shared), len(fit.own), len(fit.crossings)
    names = [n for n in GIVEN if n not in NOT_LISTED]
    outside = [n for n in names if n not in solution.names]
    columns = np.array([names.index(n) for n in outside], dtype=np.intp)
    simulator = fit.simulator_of((*outside, *fit.simulator.unknowns))
    normal, right = np.zeros((s + g * m, s + g * m)), np.zeros((s + g * m, len(names)))
    for run, crossing in enumerate(fit.crossings):
        theta, scale = fit.local(solution, run), fit.scales[run]
        jacobian = BumpRows(fit)(run, theta).jacobian
        at_known = np.array([fit.known.values[n] for n in outside])
        simulated = simulator(crossing.drive, np.concatenate([at_known, theta[: scale.size] * scale]))
        by_known = np.concatenate(
            [
                simulated.sensitivities[n][np.isfinite(crossing.channels[n]), : len(outside)]
                / fit.weights.deviation(crossing, n)
                for n in fit.channels
            ]
        )
        at = np.concatenate([np.arange(s), s + run * m + np.arange(m)])
        normal[np.ix_(at, at)] += jacobian.T @ jacobian
        right[at[:, None], columns] -= jacobian.T @ by_known
    weights = np.array([0.0 if u.prior is None else u.prior[1] ** -2.0 for u in (*fit.shared, *fit.own * g)])
    normal += np.diag(weights)
    for column, name in enumerate(names):
        if name in solution.names:
            row = solution.names.index(name)
            right[row, column] = weights[row]
    scale = 1.0 / np.sqrt(np.diag(normal))
    slopes = scale[:, None] * np.linalg.solve(normal * np.outer(scale, scale), scale[:, None] * right)
    return {n: {sought: float(slopes[i, k]) for i, sought in enumerate(SOUGHT)} for k, n in enumerate(names)}
