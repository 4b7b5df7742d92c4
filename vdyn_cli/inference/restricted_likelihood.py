"""Estimation of noise amplitudes by restricted maximum likelihood.

With each run's residual r, derivatives J to the shared and U to the run's own unknowns, and covariance C(amplitudes),
the estimate minimizes over the logarithms x of the amplitudes::

    sum 1/2 log |C| + 1/2 log |A| + 1/2 sum e' C^-1 e + sum 1/2 ((x - typical)/spread)^2,
    A = sum J' C^-1 J,  e = r - J A^-1 sum J' C^-1 r

The term log |A| accounts for the part of the noise that the fitted unknowns absorb: without it the amplitudes are
biased low. The run's own unknowns have a wide prior, C + D^2 U U'.
Random unknowns with a common standard deviation (the slopes of a road that all runs share) belong to the shared
unknowns, with a prior of standard deviation one and derivatives scaled by that common standard deviation. The runs
are then no longer independent, and the restricted likelihood is that of all runs together.
Source: Patterson and Thompson, Biometrika 58 (1971) 545-554.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.gust_covariance import SOURCES, Colored, RunNoise
from vdyn_cli.quantities.arrays import Array

WIDE = 10.0  # prior standard deviation of the own unknowns, in their units: far above the error of a start speed
NEGLIGIBLE = 1e-3  # gain of log likelihood that ends the iteration: less changes an amplitude by < 0.05 std
FARTHEST = 1.0  # of a logarithm, in one step
MOST_STEPS = 100
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
    """Shared unknowns that are random with a common standard deviation, which is one of the noise amplitudes.

    Parameters
    ----------
    source : name of the amplitude. columns : their indices among the shared unknowns.
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
    """Estimate the amplitudes of all noise sources, common to the runs, each in its source's unit.

    Newton's iteration with the average information as the second derivative (Gilmour, Thompson and Cullis,
    Biometrics 51 (1995) 1440-1450): a few evaluations, each of which passes over all runs.

    Parameters
    ----------
    start : start values; their names are the sources to estimate.
    priors : (s,), prior information (1/variance) of the shared unknowns; zero for none.
    random : shared unknowns whose standard deviation is among the amplitudes; the residuals are those for zero values.
    most : the largest physical amplitude of a source.

    Raises
    ------
    ArithmeticError : the covariance is not positive definite in floating point.
    """
    return _most_likely(runs, start, priors, random, most)[0]


def log_evidence(
    runs: Sequence[NoisyRun],
    start: Mapping[str, float],
    priors: Array,
    random: RandomUnknowns | None = None,
) -> float:
    """The log likelihood, up to a constant, with the most likely noise amplitudes and all unknowns integrated out.

    -1/2 sum log |C| - 1/2 log |A| - 1/2 sum e' C^-1 e - 1/2 sum ((x - typical)/spread)^2 + 1/2 log |K|

    with the prior information K of the shared unknowns that have any. Models with different unknowns can be compared:
    the difference is the logarithm of the Bayes factor, with amplitudes at their maximum (Laplace's method).

    Parameters
    ----------
    runs, start, priors, random : as in ``find_sizes``.

    Raises
    ------
    ArithmeticError : the covariance is not positive definite in floating point.
    """
    stated = priors[priors > 0.0]
    return 0.5 * float(np.sum(np.log(stated))) - _most_likely(runs, start, priors, random)[1]


def _most_likely(
    runs: Sequence[NoisyRun],
    start: Mapping[str, float],
    priors: Array | None,
    random: RandomUnknowns | None,
    most: Mapping[str, float] = MappingProxyType({}),
) -> tuple[dict[str, float], float]:
    """The most likely noise amplitudes, and the module's objective there."""
    names = tuple(start)
    center = np.log([SOURCES[n].typical for n in names])
    spread = np.array([SOURCES[n].spread for n in names])
    known = np.zeros(runs[0].shared.shape[1]) if priors is None else priors.copy()
    if random is not None:
        known[random.columns] = 1.0

    def cost(x: Array) -> _Quadratic:
        found = _negative_likelihood(runs, dict(zip(names, np.exp(x).tolist(), strict=True)), known, random)
        away = (x - center) / spread
        return _Quadratic(
            found.value + 0.5 * float(away @ away),
            found.gradient + away / spread,
            found.hessian + np.diag(spread**-2.0),
        )

    low, top = center - REACH * spread, center + REACH * spread
    top = np.minimum(top, [float(np.log(most.get(n, np.inf))) for n in names])
    if random is not None and random.least > 0.0:
        i = names.index(random.source)
        low[i] = float(np.log(random.least))
        top[i] = max(top[i], low[i])
    try:
        found, value = _newton(cost, np.clip(np.log([start[n] for n in names]), low, top), low, top)
    except np.linalg.LinAlgError as error:
        raise ArithmeticError(f"the covariance of the runs' noise is not positive definite: {error}") from error
    return dict(zip(names, np.exp(found).tolist(), strict=True)), value


@dataclass(frozen=True)
class _Quadratic:
    """A function's value, its gradient (k,) and a positive definite approximation (k, k) of its Hessian."""

    value: float
    gradient: Array
    hessian: Array


def _newton(cost: Callable[[Array], _Quadratic], x: Array, low: Array, top: Array) -> tuple[Array, float]:
    """The minimum within bounds and the value near it, by Newton steps of at most FARTHEST.

    They are halved where they do not reduce the value.
    """
    here, reach = cost(x), FARTHEST
    for _ in range(MOST_STEPS):
        held = ((x <= low) & (here.gradient > 0)) | ((x >= top) & (here.gradient < 0))
        free, step = np.flatnonzero(~held), np.zeros_like(x)
        step[free] = -np.linalg.solve(here.hessian[np.ix_(free, free)], here.gradient[free])
        step *= min(1.0, reach / max(float(np.max(np.abs(step), initial=0.0)), reach))
        step = np.clip(x + step, low, top) - x
        if -0.5 * float(here.gradient @ step) < NEGLIGIBLE:
            return np.asarray(x + step), here.value
        there = cost(x + step)
        if there.value < here.value:
            x, here, reach = x + step, there, FARTHEST
        else:
            reach = 0.5 * float(np.max(np.abs(step)))
    return x, here.value


def likelihoods_of(
    runs: Sequence[NoisyRun],
    sizes: Mapping[str, float],
    known: Array,
    random: RandomUnknowns,
    alternatives: Sequence[Sequence[Array]],
) -> Array:
    """The restricted log likelihood, up to a constant, of alternative models of the random unknowns.

    -1/2 log |A| + 1/2 b' A^-1 b,   A = K + sum J' C^-1 J,   b = sum J' C^-1 r

    with K the prior information and C the noise covariance of each run, the same in all models.

    Parameters
    ----------
    runs, sizes : the runs at the fit, and the amplitudes of their noise by name.
    known : (s,), prior information of the shared unknowns.
    alternatives : of each of k models, every run's derivatives (n, r) to the r random unknowns per unit amplitude.

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
        # By eigenvalues, because unknowns to which no run responds have no information (in all alternatives alike).
        values, axes = np.linalg.eigh(information)
        good = values > 1e-12 * values[-1]
        fitted = (axes[:, good].T @ pulled) ** 2 / values[good]
        found.append(-0.5 * float(np.sum(np.log(values[good]))) + 0.5 * float(np.sum(fitted)))
    return np.array(found)


def _negative_likelihood(
    runs: Sequence[NoisyRun], sizes: Mapping[str, float], known: Array, random: RandomUnknowns | None
) -> _Quadratic:
    """The negative restricted log likelihood as a function of the logarithms of the amplitudes, in their order.

    The average information is 1/2 e' C_i P C_j e, with the derivatives C_i of the covariance, e = P r, and
    P = C^-1 - C^-1 J A^-1 J' C^-1.
    """
    s = known.size
    information, pulled, value = np.diag(known), np.zeros(s), 0.0
    solved = []
    scale = np.ones(s)
    if random is not None:
        scale[random.columns] = sizes[random.source]
    for run in runs:
        one = _solved(run, sizes, scale)
        information += one.shared.T @ one.weighted[:, :s]
        pulled += one.shared.T @ one.weighted[:, s]
        value += float(np.sum(np.log(np.diag(one.factor)))) + 0.5 * float(run.residual @ one.weighted[:, s])
        solved.append(one)
    inverse: Array = np.linalg.pinv(information, hermitian=True).astype(np.float64, copy=False)
    step = inverse @ pulled
    value += 0.5 * float(np.linalg.slogdet(information)[1]) - 0.5 * float(pulled @ step)
    names = tuple(sizes)
    gradient, hessian, absorbed = np.zeros(len(names)), np.zeros((len(names), len(names))), np.zeros((s, len(names)))
    shown = np.zeros(len(names))
    for run, one in zip(runs, solved, strict=True):
        weight, left = one.remaining(inverse, step)
        slopes, pushes = run.noise.derivatives(sizes, weight, left)
        moved = np.zeros((left.size, len(names)))
        for name, derivative in slopes.items():
            gradient[names.index(name)] += 0.5 * derivative
            moved[:, names.index(name)] = pushes[name]
        if random is not None:
            moved[:, names.index(random.source)] = 2 * one.shared[:, random.columns] @ step[random.columns]
        shown += 0.5 * left @ moved
        hessian += 0.5 * moved.T @ one.times_inverse(moved)
        absorbed += one.weighted[:, :s].T @ moved
    hessian -= 0.5 * absorbed.T @ inverse @ absorbed
    if random is not None:
        # d/d log(amplitude) of both terms, with S = A minus the prior: S x = p - x and tr(S A^-1) = k - tr(A^-1).
        own = inverse[np.ix_(random.columns, random.columns)]
        gradient[names.index(random.source)] += (
            random.columns.size - float(np.trace(own)) - float(np.sum(step[random.columns] ** 2))
        )
    times = {p.time for run in runs for p in run.noise.parts if isinstance(p, Colored)}
    amplitudes = np.array([n not in times for n in names])
    return _Quadratic(
        value, gradient, hessian + np.diag(np.where(amplitudes, _beside_others(gradient, hessian, shown), 0.0))
    )


def _beside_others(gradient: Array, hessian: Array, shown: Array) -> Array:
    """Correction (k,) of the average information for amplitudes that are small beside other noise.

    With the shares l of the variance that an amplitude contributes, over all directions of the data, the likelihood's
    derivative is sum(l) minus the part in the residuals, and the average information is 2 sum(l^2) where the model
    holds. Where the shares are small, it lacks twice the derivative; where they are one, nothing.

    Parameters
    ----------
    gradient : (k,) derivatives. hessian : (k, k) average information. shown : (k,) part in the residuals.
    """
    share = 0.5 * np.diag(hessian) / np.maximum(shown, 1e-300)
    return np.asarray(2 * np.maximum(gradient, 0.0) * (1.0 - np.clip(share, 0.0, 1.0)))


@dataclass(frozen=True)
class _SolvedRun:
    """One run with its covariance factored: derivatives (n, s) to the shared unknowns, and C^-1 [derivatives | r]."""

    factor: Array
    shared: Array
    weighted: Array

    def times_inverse(self, columns: Array) -> Array:
        """C^-1 of (n, k) columns."""
        from scipy.linalg.lapack import dpotrs

        return np.asarray(dpotrs(self.factor, columns, lower=1)[0])

    def remaining(self, inverse: Array, step: Array) -> tuple[Array, Array]:
        """P - e e', (n, n), and the weighted residual e = P r, (n,), with P as in ``_negative_likelihood``.

        Parameters
        ----------
        inverse : (s, s), A^-1. step : (s,), A^-1 J' C^-1 r.
        """
        from scipy.linalg.lapack import dpotri

        s = self.shared.shape[1]
        left = self.weighted[:, s] - self.weighted[:, :s] @ step
        weight = dpotri(self.factor, lower=1)[0]
        weight = np.tril(weight) + np.tril(weight, -1).T
        weight -= (self.weighted[:, :s] @ inverse) @ self.weighted[:, :s].T
        weight -= np.outer(left, left)
        return weight, left


def _solved(run: NoisyRun, sizes: Mapping[str, float], scale: Array) -> _SolvedRun:
    from scipy.linalg.lapack import dpotrf, dpotrs

    own = run.own / np.maximum(1.0, np.max(np.abs(run.own), axis=0, initial=0.0))  # bounded: WIDE is wide enough
    covariance = run.noise.covariance(sizes) + WIDE**2 * own @ own.T
    factor, wrong = dpotrf(covariance.T, lower=1, overwrite_a=1)  # symmetric; its transpose is in order of columns
    if wrong:
        raise np.linalg.LinAlgError(f"leading minor {wrong} is not positive")
    shared = run.shared * scale
    return _SolvedRun(factor, shared, dpotrs(factor, np.column_stack([shared, run.residual]), lower=1)[0])
