"""Noise amplitudes from the data, by restricted maximum likelihood.

For each run's residual r, derivatives J to the shared and U to the run's own unknowns, and covariance C(amplitudes),
minimized over the logarithms x of the amplitudes::

    sum 1/2 log |C| + 1/2 log |A| + 1/2 sum e' C^-1 e + sum 1/2 ((x - typical)/spread)^2,
    A = sum J' C^-1 J,  e = r - J A^-1 sum J' C^-1 r

The term log |A| accounts for the part of the noise that the fitted unknowns absorb: without it the amplitudes are
biased low. The run's own unknowns have a wide prior, C + D^2 U U'.
Source: Patterson and Thompson, Biometrika 58 (1971) 545-554.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.gust_covariance import SOURCES, RunNoise

Array = NDArray[np.float64]

WIDE = 10.0  # prior standard deviation of the own unknowns, in their units: far above the error of a start speed
FLAT, LEVEL = 1e-7, 1e-2  # relative fall of the cost, and slope per logarithm, at convergence
REACH = 4.0  # bound of an amplitude, in prior standard deviations from the typical one


@dataclass(frozen=True)
class NoisyRun:
    """One run at the fit: residual (n,), derivatives to shared (n, s) and own (n, m) unknowns, and its noise model."""

    residual: Array
    shared: Array
    own: Array
    noise: RunNoise


def typical_sizes(noise: RunNoise) -> dict[str, float]:
    """The typical amplitude of every noise source of a run."""
    return {name: SOURCES[name].typical for name in noise.sources}


def find_sizes(runs: Sequence[NoisyRun], start: Mapping[str, float], priors: Array | None = None) -> dict[str, float]:
    """The amplitudes of all noise sources, common to the runs.

    Parameters
    ----------
    start : start values; their names are the sources to estimate.
    priors : (s,), prior information (1/variance) of the shared unknowns; zero for none.

    Raises
    ------
    ArithmeticError : the covariance is not positive definite in floating point.
    """
    from scipy.optimize import minimize

    names = tuple(start)
    center = np.log([SOURCES[n].typical for n in names])
    spread = np.array([SOURCES[n].spread for n in names])
    known = np.zeros(runs[0].shared.shape[1]) if priors is None else priors

    def cost(x: Array) -> tuple[float, Array]:
        sizes = dict(zip(names, np.exp(x).tolist(), strict=True))
        value, slopes = _likelihood(runs, sizes, known)
        away = (x - center) / spread
        return value + 0.5 * float(away @ away), np.array([slopes[n] for n in names]) + away / spread

    bounds = [(c - REACH * s, c + REACH * s) for c, s in zip(center, spread, strict=True)]
    begin = np.log([start[n] for n in names])
    try:
        found = minimize(cost, begin, jac=True, method="L-BFGS-B", bounds=bounds, options={"ftol": FLAT, "gtol": LEVEL})
    except np.linalg.LinAlgError as error:
        raise ArithmeticError(f"the covariance of the runs' noise is not positive definite: {error}") from error
    return dict(zip(names, np.exp(found.x).tolist(), strict=True))


def _likelihood(runs: Sequence[NoisyRun], sizes: Mapping[str, float], known: Array) -> tuple[float, dict[str, float]]:
    """The negative restricted log likelihood, and its derivatives to the logarithms of the amplitudes."""
    from scipy.linalg import cho_factor, cho_solve

    s = known.size
    information, pulled, value = np.diag(known), np.zeros(s), 0.0
    solved = []
    for run in runs:
        own = run.own / np.maximum(1.0, np.max(np.abs(run.own), axis=0, initial=0.0))  # the prior need not be wider
        covariance = run.noise.covariance(sizes) + WIDE**2 * own @ own.T
        factor = cho_factor(covariance, lower=True, overwrite_a=True, check_finite=False)
        weighted = cho_solve(factor, np.column_stack([run.shared, run.residual]), check_finite=False)
        information = information + run.shared.T @ weighted[:, :s]
        pulled = pulled + run.shared.T @ weighted[:, s]
        value += float(np.sum(np.log(np.diag(factor[0])))) + 0.5 * float(run.residual @ weighted[:, s])
        solved.append((factor, weighted))
    inverse = np.linalg.pinv(information, hermitian=True)
    step = inverse @ pulled
    value += 0.5 * float(np.linalg.slogdet(information)[1]) - 0.5 * float(pulled @ step)
    slopes = dict.fromkeys(sizes, 0.0)
    for run, (factor, weighted) in zip(runs, solved, strict=True):
        left = weighted[:, s] - weighted[:, :s] @ step
        weight = cho_solve(factor, np.eye(left.size), overwrite_b=True, check_finite=False)
        weight -= weighted[:, :s] @ inverse @ weighted[:, :s].T + np.outer(left, left)
        for name, slope in run.noise.slopes(sizes, weight).items():
            slopes[name] += 0.5 * slope
    return value, slopes
