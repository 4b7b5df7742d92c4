"""Noise amplitudes from the data, by restricted maximum likelihood.

For each run's residual r, derivatives J to the shared and U to the run's own unknowns, and covariance C(amplitudes),
minimized over the logarithms x of the amplitudes::

    sum 1/2 log |C| + 1/2 log |A| + 1/2 sum e' C^-1 e + sum 1/2 ((x - typical)/spread)^2,
    A = sum J' C^-1 J,  e = r - J A^-1 sum J' C^-1 r

The term log |A| accounts for the part of the noise that the fitted unknowns absorb: without it the amplitudes are
biased low. The run's own unknowns have a wide prior, C + D^2 U U'.
Unknowns that are random with a common standard deviation (the slopes of a road that all runs share) stay among the
shared ones with a prior of one, their derivatives scaled by that standard deviation. The restricted likelihood is
then that of all runs together, which are no longer independent.
Source: Patterson and Thompson, Biometrika 58 (1971) 545-554.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

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


@dataclass(frozen=True)
class RandomUnknowns:
    """Shared unknowns with a common standard deviation of their own, which is one of the noise's amplitudes.

    Parameters
    ----------
    source : name of the amplitude. columns : indices among the shared unknowns; their derivatives are per unit of it.
    least : smallest amplitude.
    """

    source: str
    columns: NDArray[np.intp]
    least: float = 0.0


def find_sizes(
    runs: Sequence[NoisyRun],
    start: Mapping[str, float],
    priors: Array | None = None,
    random: RandomUnknowns | None = None,
    most: Mapping[str, float] = MappingProxyType({}),
) -> dict[str, float]:
    """The amplitudes of all noise sources, common to the runs.

    Parameters
    ----------
    start : start values; their names are the sources to estimate.
    priors : (s,), prior information (1/variance) of the shared unknowns; zero for none.
    random : shared unknowns whose standard deviation is among the amplitudes; the residuals are those at their zero.
    most : the largest physical amplitude of a source; what exceeds it stays in the residual.

    Raises
    ------
    ArithmeticError : the covariance is not positive definite in floating point.
    """
    from scipy.optimize import minimize

    names = tuple(start)
    center = np.log([SOURCES[n].typical for n in names])
    spread = np.array([SOURCES[n].spread for n in names])
    known = np.zeros(runs[0].shared.shape[1]) if priors is None else priors.copy()
    if random is not None:
        known[random.columns] = 1.0

    def cost(x: Array) -> tuple[float, Array]:
        sizes = dict(zip(names, np.exp(x).tolist(), strict=True))
        value, slopes = restricted_likelihood(runs, sizes, known, random)
        away = (x - center) / spread
        return value + 0.5 * float(away @ away), np.array([slopes[n] for n in names]) + away / spread

    upper = [
        min(c + REACH * s, float(np.log(most.get(n, np.inf)))) for n, c, s in zip(names, center, spread, strict=True)
    ]
    bounds = [(c - REACH * s, top) for c, s, top in zip(center, spread, upper, strict=True)]
    if random is not None and random.least > 0.0:
        i = names.index(random.source)
        bounds[i] = (float(np.log(random.least)), max(bounds[i][1], float(np.log(random.least))))
    begin = np.clip(np.log([start[n] for n in names]), *np.transpose(bounds))
    try:
        found = minimize(cost, begin, jac=True, method="L-BFGS-B", bounds=bounds, options={"ftol": FLAT, "gtol": LEVEL})
    except np.linalg.LinAlgError as error:
        raise ArithmeticError(f"the covariance of the runs' noise is not positive definite: {error}") from error
    return dict(zip(names, np.exp(found.x).tolist(), strict=True))


def likelihoods_of(
    runs: Sequence[NoisyRun],
    sizes: Mapping[str, float],
    known: Array,
    random: RandomUnknowns,
    alternatives: Sequence[Sequence[Array]],
) -> Array:
    """The restricted log likelihood, up to a constant, for each of several derivatives to the random unknowns.

    Parameters
    ----------
    known : (s,), prior information of the shared unknowns.
    alternatives : for each of k, every run's (n, r) derivatives to r random unknowns per unit of the amplitude.

    Returns
    -------
    (k,).
    """
    s, columns = known.size, random.columns
    others = np.delete(np.arange(s), columns)
    whitened = []
    for run in runs:
        own = run.own / np.maximum(1.0, np.max(np.abs(run.own), axis=0, initial=0.0))
        factor = np.linalg.cholesky(run.noise.covariance(sizes) + WIDE**2 * own @ own.T)
        inverse = np.linalg.inv(factor)
        whitened.append((inverse, inverse @ run.shared[:, others], inverse @ run.residual))
    found = []
    for each in alternatives:
        rows = [
            np.column_stack([fixed, sizes[random.source] * (inverse @ slope), left])
            for (inverse, fixed, left), slope in zip(whitened, each, strict=True)
        ]
        own_prior = np.ones(rows[0].shape[1] - others.size - 1)
        product = sum((r.T @ r for r in rows), np.diag(np.r_[known[others], own_prior, 0.0]))
        information, pulled = product[:-1, :-1], product[:-1, -1]
        # By eigenvalues: unknowns that no run shows have no information, in all alternatives alike.
        values, axes = np.linalg.eigh(information)
        good = values > 1e-12 * values[-1]
        fitted = (axes[:, good].T @ pulled) ** 2 / values[good]
        found.append(-0.5 * float(np.sum(np.log(values[good]))) + 0.5 * float(np.sum(fitted)))
    return np.array(found)


def restricted_likelihood(
    runs: Sequence[NoisyRun], sizes: Mapping[str, float], known: Array, random: RandomUnknowns | None = None
) -> tuple[float, dict[str, float]]:
    """The negative restricted log likelihood, and its derivatives to the logarithms of the amplitudes.

    Parameters
    ----------
    known : (s,), prior information of the shared unknowns, one for random ones.
    """
    from scipy.linalg import cho_factor, cho_solve

    s = known.size
    information, pulled, value = np.diag(known), np.zeros(s), 0.0
    solved = []
    scale = np.ones(s)
    if random is not None:
        scale[random.columns] = sizes[random.source]
    for run in (replace(one, shared=one.shared * scale) for one in runs) if random is not None else runs:
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
    if random is not None:
        # d/d log(amplitude) of both terms, with S = A less the prior: S x = p - x and tr(S A^-1) = k - tr(A^-1).
        own = inverse[np.ix_(random.columns, random.columns)]
        slopes[random.source] += random.columns.size - float(np.trace(own)) - float(np.sum(step[random.columns] ** 2))
    return value, slopes
