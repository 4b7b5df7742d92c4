"""Sensitivity of a fit's result to numbers that it takes as known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.inference import Regression
from vdyn_cli.inference.regression import stacked
from vdyn_cli.quantities.arrays import Array


def slopes_by_known(
    extended: Regression, known: Sequence[str], values: Mapping[str, float], per_run: Mapping[str, Array]
) -> dict[str, dict[str, float]]:
    """Total derivatives d unknown / d known at a solution, by known number and shared unknown.

    With J the whitened derivatives by all unknowns, P the priors' weights and d the derivatives by a known number,
    slope = -(J'J + P)^-1 J'd; of an uncertain number, which is an unknown with a prior, (J'J + P)^-1 P. Each run's own
    unknowns are eliminated: J and d are orthogonal to their derivatives.

    Parameters
    ----------
    extended : the fit's regression with the known numbers as further shared unknowns; held ones have no prior.
    values, per_run : of all its unknowns at the solution, SI; those of each run (runs,).
    """
    shared, own = extended.shared, extended.own
    held = [k for k, u in enumerate(shared) if u.name in known and u.prior is None]
    free = [k for k in range(len(shared)) if k not in held]
    names = [shared[k].name for k in free]
    x, gram = stacked(extended.unknowns, values, per_run), np.zeros((len(shared), len(shared)))
    prior = np.diag([0.0 if u.prior is None else 1.0 / u.prior[1] for u in own])
    for run in range(len(extended.runs)):
        jacobian = extended.rows(run, extended.local(x, run)).jacobian
        of_shared = np.vstack([jacobian[:, : len(shared)], np.zeros((len(own), len(shared)))])
        basis = np.linalg.qr(np.vstack([jacobian[:, len(shared) :], prior]))[0]  # of the run's own unknowns
        of_shared -= basis @ (basis.T @ of_shared)
        gram += of_shared.T @ of_shared
    weights = np.array([0.0 if (one := shared[k].prior) is None else one[1] ** -2.0 for k in free])
    normal, right = gram[np.ix_(free, free)] + np.diag(weights), np.zeros((len(free), len(known)))
    right[:, [known.index(shared[k].name) for k in held]] = -gram[np.ix_(free, held)]
    for row, name in enumerate(names):
        if name in known:
            right[row, known.index(name)] = weights[row]
    scale = 1.0 / np.sqrt(np.diag(normal))
    slopes = scale[:, None] * np.linalg.solve(normal * np.outer(scale, scale), scale[:, None] * right)
    return {n: dict(zip(names, slopes[:, k].tolist(), strict=True)) for k, n in enumerate(known)}
