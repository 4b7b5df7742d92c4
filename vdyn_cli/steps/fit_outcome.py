"""Parameters and fit summary of a result, from the solution of its fit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from vdyn_cli.inference import Solution
from vdyn_cli.inference.uncertainty_budget import Contribution
from vdyn_cli.quantities.arrays import Array, rms
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import FitSummary


def fitted_parameters(solution: Solution, names: Sequence[str], step: str) -> Parameters:
    """The estimates of parameters that are unknowns of the fit, with their correlation.

    Parameters
    ----------
    names : parameters of the vocabulary. step : which estimated them.
    """
    s, correlation = solution, solution.correlation
    return Parameters(
        {n: Estimate.of(n, s.values[n], s.std[n], s.interval95[n], step) for n in names},
        {a: {b: correlation[a][b] for b in names} for a in names},
    )


def fit_summary(
    solution: Solution,
    runs: Iterable[str],
    residuals: Sequence[Array],
    noise: Sequence[Array | float],
    unit: str,
    warnings: Sequence[str] = (),
) -> FitSummary:
    """The summary of a fit, with the rms of its residuals and of their noise.

    Parameters
    ----------
    runs : names of the runs.
    residuals : (n,) each, of the main channel in ``unit``, NaN where there is no reading.
    noise : expected standard deviations of the residuals, in ``unit``.
    warnings : in addition to those of the solution.
    """
    every = (*solution.warnings, *warnings)
    return FitSummary(
        tuple(runs), rms(*residuals), rms(*noise), unit, solution.names, solution.unit, solution.n_units, warnings=every
    )


def scatter(solution: Solution, name: str, unit: str) -> Contribution:
    """The contribution of the data's scatter to the budget of an estimate, whose slope is one.

    Parameters
    ----------
    name : of the unknown. unit : of its value.
    """
    return Contribution(
        "scatter_of_the_data", solution.values[name], solution.std[name], unit, 1.0, solution.degrees[name]
    )
