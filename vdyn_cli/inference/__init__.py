"""Nonlinear least squares over runs: shared and per-run unknowns, intervals from independent units, identifiability."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from vdyn_cli.inference.intervals import equal_information_blocks
from vdyn_cli.inference.minimize import Minimum, minimize
from vdyn_cli.inference.normal_system import Solved
from vdyn_cli.inference.refusals import refusals
from vdyn_cli.inference.regression import Loss, Objective, Regression, Rows, Unknown
from vdyn_cli.inference.solution import Downweighted, Solution, Unit
from vdyn_cli.inference.unit_scatter import infer
from vdyn_cli.inference.white_noise import NORMAL_FROM_MEDIAN, exceeds_noise, white_level, whiten
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, ResultError

__all__ = [
    "Downweighted",
    "RefusedFitError",
    "Regression",
    "Rows",
    "Solution",
    "Unit",
    "Unknown",
    "approach",
    "equal_information_blocks",
    "exceeds_noise",
    "solve",
    "standing",
    "white_level",
    "whiten",
]


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


def standing(fit: Callable[[], Solution]) -> Solution:
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
    robust: Loss = "none",
    units: Literal["auto", "run", "block"] = "auto",
    most_iterations: int = 200,
    tolerance: float = 0.0,
    unconverged: bool = False,
) -> Solution:
    """Fit shared and per-run unknowns to all runs at once, with their uncertainty.

    Minimizes sum over runs and rows of rho(r), plus half the squares of the priors, within the physical ranges;
    rho(r) = r^2 / 2 unless robust.

    Parameters
    ----------
    robust : "huber" or "soft_l1" down-weight outliers, which ``downweighted`` lists.
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
    minimum, scale = _minimize(regression, robust, most_iterations, tolerance)
    solved = Solved(regression, minimum, robust, scale)
    if findings := refusals(solved, unconverged):
        raise RefusedFitError(findings, regression, lambda: infer(solved, units))
    return infer(solved, units)


def approach(regression: Regression, most_iterations: int) -> tuple[dict[str, float], dict[str, Array]]:
    """Values of the unknowns after a few iterations, without checks and intervals.

    For fits of which only the residual is used. Unknowns that the data do not determine need priors.

    Returns
    -------
    Shared unknowns by name, and per-run unknowns by name, (runs,) each.

    Raises
    ------
    ResultError : the model has no finite value at the start.
    """
    minimum, _ = _minimize(regression, "none", most_iterations, 1.0)
    s, m = len(regression.shared), len(regression.own)
    x = minimum.point.x
    each = x[s:].reshape(len(regression.runs), m)
    shared = {u.name: float(v) for u, v in zip(regression.shared, x, strict=False)}
    return shared, {u.name: each[:, i] for i, u in enumerate(regression.own)}


def _minimize(regression: Regression, loss: Loss, most_iterations: int, tolerance: float) -> tuple[Minimum, float]:
    """The minimum and, for a robust loss, the scale of the residuals from their median."""
    lower, upper = regression.bounds()

    def run(start: Array, loss: Loss, scale: float) -> Minimum:
        try:
            return minimize(Objective(regression, loss, scale), start, lower, upper, most_iterations, tolerance)
        except ArithmeticError as error:
            raise ResultError(
                Finding(
                    "fit", str(error), _start_text(regression, start), "check the start values and the logs for gaps"
                )
            ) from error

    minimum, scale = run(regression.start(), "none", 1.0), 1.0
    if loss == "none":
        return minimum, scale
    for _ in range(20):
        x = minimum.point.x
        residual = np.concatenate(
            [regression.rows(i, regression.local(x, i)).residual for i in range(len(regression.runs))]
        )
        before, scale = scale, NORMAL_FROM_MEDIAN * float(np.median(np.abs(residual)))
        scale = scale or float(np.sqrt(np.mean(residual**2))) or 1.0
        minimum = run(x, loss, scale)
        if abs(scale - before) < 1e-3 * before:
            break
    return minimum, scale


def _start_text(regression: Regression, x: Array) -> str:
    return ", ".join(f"{u.name} = {v:.4g} {u.unit}".strip() for u, v in zip(regression.shared, x, strict=False))
