"""Nonlinear least squares with checks: the solution, or the refusal of a fit that cannot be published."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from vdyn_cli.inference.minimize import Minimum, minimize
from vdyn_cli.inference.normal_system import Solved
from vdyn_cli.inference.refusals import refusals
from vdyn_cli.inference.regression import Objective, Regression
from vdyn_cli.inference.solution import Solution
from vdyn_cli.inference.unit_scatter import infer
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, ResultError


class RefusedFitError(ResultError):
    """A fit whose minimum cannot be published; a diagnosis can still show it and start from it.

    Parameters
    ----------
    findings : the reasons. regression : the regression solved. ends : () -> the refused solution, with its intervals.
    """

    def __init__(self, findings: Sequence[Finding], regression: Regression, ends: Callable[[], Solution]) -> None:
        super().__init__(*findings)
        self.regression = regression
        self._ends = ends

    def solution(self) -> Solution | None:
        """The refused solution; None where its information is singular, so that it has no intervals."""
        try:
            return self._ends()
        except (np.linalg.LinAlgError, ArithmeticError, ValueError):
            return None


def even_if_refused(fit: Callable[[], Solution]) -> Solution:
    """The solution of a fit, also of a refused one, as the starting point of a diagnosis.

    Parameters
    ----------
    fit : () -> solution; may raise RefusedFitError.

    Raises
    ------
    ResultError : the fit has no solution, not even a refused one.
    """
    try:
        return fit()
    except RefusedFitError as error:
        solution = error.solution()
        if solution is None:
            raise
        return solution


def solve(
    regression: Regression,
    *,
    units: Literal["auto", "run", "block"] = "auto",
    most_iterations: int = 200,
    tolerance: float = 0.0,
    unconverged: bool = False,
) -> Solution:
    """Fit shared and per-run unknowns to all runs at once, with their uncertainty.

    Minimizes half the sum of squares over the rows of all runs and the priors, within the physical ranges.

    Parameters
    ----------
    units : the independent unit; "auto" takes runs where there are enough, else blocks within runs.
    most_iterations : largest number of iterations.
    tolerance : convergence: largest predicted reduction of the sum of squares by a further step, in variances of one
        residual (1e-3 is 3 % of a standard deviation); 0 iterates to rounding. For nondifferentiable models, such as
        a wheel that leaves the road.
    unconverged : accept a fit that did not converge, as the starting point of a diagnosis.

    Raises
    ------
    RefusedFitError
        The fit does not converge; the unknowns are not identifiable (the message names the combination that is); or a
        value lies at its bound.
    """
    solved = Solved(regression, _minimize(regression, most_iterations, tolerance))
    if findings := refusals(solved, unconverged):
        raise RefusedFitError(findings, regression, lambda: infer(solved, units))
    return infer(solved, units)


def approach(regression: Regression, most_iterations: int) -> tuple[dict[str, float], dict[str, Array]]:
    """Values of the unknowns after a few iterations, without checks and intervals.

    For fits of which only the residual is used. Unknowns that the data do not determine need priors.

    Parameters
    ----------
    regression : to solve. most_iterations : number of steps at most.

    Returns
    -------
    Shared unknowns by name, and per-run unknowns by name, (runs,) each, in SI.

    Raises
    ------
    ResultError : the model has no finite value at the start.
    """
    minimum = _minimize(regression, most_iterations, 1.0)
    s, m = len(regression.shared), len(regression.own)
    x = minimum.point.x
    each = x[s:].reshape(len(regression.runs), m)
    shared = {u.name: float(v) for u, v in zip(regression.shared, x, strict=False)}
    return shared, {u.name: each[:, i] for i, u in enumerate(regression.own)}


def _minimize(regression: Regression, most_iterations: int, tolerance: float) -> Minimum:
    lower, upper = regression.bounds()
    try:
        return minimize(Objective(regression), regression.start(), lower, upper, most_iterations, tolerance)
    except ArithmeticError as error:
        start = _start_text(regression, regression.start())
        remedy = "check the 'unit' of each channel and the values under 'vehicle' and 'given' for wrong powers of ten"
        raise ResultError(Finding("fit", str(error), start, remedy)) from error


def _start_text(regression: Regression, x: Array) -> str:
    return ", ".join(f"{u.name} = {v:.4g} {u.unit}".strip() for u, v in zip(regression.shared, x, strict=False))
