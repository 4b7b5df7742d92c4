"""Sensitivity of a fit's result to numbers that it takes as known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.inference import Regression
from vdyn_cli.inference.regression import evaluate, stacked
from vdyn_cli.quantities.arrays import Array


def slopes_by_known(
    extended: Regression, known: Sequence[str], values: Mapping[str, float], per_run: Mapping[str, Array]
) -> dict[str, dict[str, float]]:
    """Total derivatives d unknown / d known at a solution, by known number and shared unknown.

    With the information N = J'J + P, J the whitened derivatives by all unknowns after each run's own ones are
    eliminated, P the priors' weights and d the derivatives by a known number, slope = -N^-1 J'd; of an uncertain
    number, which is an unknown with a prior, N^-1 P.

    Parameters
    ----------
    extended : the fit's regression with the known numbers as further shared unknowns; held ones have no prior.
    values, per_run : of all its unknowns at the solution, SI; those of each run (runs,).
    """
    point = evaluate(extended, stacked(extended.unknowns, values, per_run))
    assert point is not None  # the fit ended here
    information = point.system.reduced().information
    names = [u.name for u in extended.shared]
    free = [k for k, u in enumerate(extended.shared) if u.name not in known or u.prior is not None]
    right = np.zeros((len(free), len(known)))
    for column, at in enumerate(names.index(n) for n in known):
        prior = extended.shared[at].prior
        if prior is None:
            right[:, column] = -information[free, at]
        else:
            right[free.index(at), column] = prior[1] ** -2.0
    normal = information[np.ix_(free, free)]
    scale = 1.0 / np.sqrt(np.diag(normal))
    slopes = scale[:, None] * np.linalg.solve(normal * np.outer(scale, scale), scale[:, None] * right)
    return {n: dict(zip((names[k] for k in free), slopes[:, j].tolist(), strict=True)) for j, n in enumerate(known)}
