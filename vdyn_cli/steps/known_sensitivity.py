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
    slope = -(J'J + P)^-1 J'd; of an uncertain number, which is an unknown with a prior, (J'J + P)^-1 P.

    Parameters
    ----------
    extended : the fit's regression with the known numbers as further shared unknowns; held ones have no prior.
    values, per_run : of all its unknowns at the solution, SI; those of each run (runs,).
    """
    shared, own, g = extended.shared, extended.own, len(extended.runs)
    held = [k for k, u in enumerate(shared) if u.name in known and u.prior is None]
    free = [k for k in range(len(shared)) if k not in held]
    names = [shared[k].name for k in free]
    s, m = len(free), len(own)
    columns = [known.index(shared[k].name) for k in held]
    x = stacked(extended.unknowns, values, per_run)
    normal, right = np.zeros((s + g * m, s + g * m)), np.zeros((s + g * m, len(known)))
    for run in range(g):
        jacobian = extended.rows(run, extended.local(x, run)).jacobian
        kept = jacobian[:, [*free, *range(len(shared), len(shared) + m)]]
        at = np.concatenate([np.arange(s), s + run * m + np.arange(m)])
        normal[np.ix_(at, at)] += kept.T @ kept
        right[at[:, None], columns] -= kept.T @ jacobian[:, held]
    weights = np.array([0.0 if u.prior is None else u.prior[1] ** -2.0 for u in (*(shared[k] for k in free), *own * g)])
    normal += np.diag(weights)
    for row, name in enumerate(names):
        if name in known:
            right[row, known.index(name)] = weights[row]
    scale = 1.0 / np.sqrt(np.diag(normal))
    slopes = scale[:, None] * np.linalg.solve(normal * np.outer(scale, scale), scale[:, None] * right)
    return {n: dict(zip(names, slopes[:s, k].tolist(), strict=True)) for k, n in enumerate(known)}
