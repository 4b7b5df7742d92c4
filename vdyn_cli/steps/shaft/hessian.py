"""The second derivative of a regression's cost, for regressions whose J'J contains the noise of adjusted readings."""

from __future__ import annotations

import numpy as np

from vdyn_cli.inference import Regression, Solution
from vdyn_cli.inference.regression import evaluate, stacked
from vdyn_cli.quantities.arrays import Array

DERIVATIVE_STEP = 0.3  # standard deviations, of the central differences


def curvatures(regression: Regression, solution: Solution) -> tuple[Array, Array]:
    """J'J and the cost's second derivative at a solution, with the runs' own unknowns eliminated, (s, s) each.

    The second derivative is that of J'r by central differences; both include the priors, which must be independent.
    """
    s = len(regression.shared)
    x = stacked(regression.unknowns, solution.values, solution.per_run)
    prior = np.array([u.prior[1] ** -2.0 if u.prior else 0.0 for u in (*regression.shared, *regression.own)])
    size = np.sqrt(np.diag(solution.classical_covariance))
    steps = np.concatenate([size, np.array([solution.per_run_std[u.name] for u in regression.own]).T.ravel()])
    hessian = np.diag(prior[:s])
    for run in range(len(regression.runs)):
        curvature = _hessian(regression, run, regression.local(x, run), DERIVATIVE_STEP * regression.local(steps, run))
        curvature[s:, s:] += np.diag(prior[s:])
        hessian += curvature[:s, :s] - curvature[:s, s:] @ np.linalg.solve(curvature[s:, s:], curvature[s:, :s])
    point = evaluate(regression, x)
    assert point is not None  # the fit ended here
    factor = point.system.reduced().factor[:-1, :-1]
    return factor.T @ factor, hessian


def _hessian(regression: Regression, run: int, local: Array, steps: Array) -> Array:
    """The derivative of J'r by central differences, symmetrized."""
    columns = []
    for shift in np.diag(steps):
        above, below = regression.rows(run, local + shift), regression.rows(run, local - shift)
        columns.append(above.jacobian.T @ above.residual - below.jacobian.T @ below.residual)
    curvature = np.array(columns).T / (2 * steps)
    return np.asarray((curvature + curvature.T) / 2)
