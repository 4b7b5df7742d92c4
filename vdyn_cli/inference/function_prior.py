"""Smooth functions of one coordinate as sums of cosines, and the evidence for them in a whitened linear system.

A function f(x) = sum_i a_i cos(i pi u), u in [0, 1] along the coordinate, with independent a_i ~ N(0, s_i^2) is a
Gaussian process with a Matern covariance (smoothness 5/2) where

    s_i^2 = size^2 (5 / l^2 + (i pi)^2)^-3 / sum_j (5 / l^2 + (j pi)^2)^-3

with the length l as a share of the span. The basis does not depend on size and length, so the evidence can select both
without another simulation.
Source: Solin and Sarkka, Hilbert space methods for reduced-rank Gaussian process regression, Stat. Comput. 30 (2020).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Array

LENGTHS = (0.04, 0.08, 0.15, 0.3, 0.6)  # of the span: from the narrowest cosine of the basis to nearly a straight line
HIGHEST = 5  # highest coefficients, from which the truncated ones are extrapolated: a quarter of the basis
SIZES = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)  # of the plausible size: from a hundredth to ten times


def spectrum(orders: Array, length: float) -> Array:
    """Variances (n,) of the coefficients of cos(i pi u), i in ``orders`` (n,), for a ``length`` as a share of the span.

    v_i = c (5 / length^2 + (i pi)^2)^-3, sum v_i = 1: the spectral density of a Matern 5/2 process

    Source: Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, equation (4.15).
    """
    density = (5.0 / length**2 + (np.pi * orders) ** 2) ** -3.0
    return np.asarray(density / density.sum())


def truncation_error(coefficients: Array, orders: Array) -> float:
    """Truncation error: mean square of the omitted cosines above the highest order, (value unit)^2.

    The coefficients of a law with a kink in its slope fall as i^-2: with m the mean square of the highest ones at n,
    sum over i > n of m (n / i)^4 / 2 = m n / 6.

    Parameters
    ----------
    coefficients : (n,) estimates. orders : (n,) ascending.
    """
    return float(np.mean(coefficients[-HIGHEST:] ** 2) * orders[-1] / 6.0)


@dataclass(frozen=True)
class FunctionEvidence:
    """How well a function of one coordinate explains a whitened system.

    Parameters
    ----------
    gain : log marginal likelihood over that of the system without the function.
    explained : reduction of the sum of squares at the most likely function.
    variance : (n,) prior variances of the coefficients at the best size and length.
    """

    gain: float
    explained: float
    variance: Array


def function_evidence(information: Array, score: Array, variance: Array) -> FunctionEvidence:
    """Evidence for coefficients a ~ N(0, diag variance) in y = H a + noise of unit variance.

    gain = 1/2 [g' (A + S^-1)^-1 g - log det(1 + S^1/2 A S^1/2)],   A = H'H, g = H'y

    Parameters
    ----------
    information : (n, n) A. score : (n,) g. variance : (n,) diagonal of S.
    """
    root = np.sqrt(variance)
    matrix = np.eye(root.size) + root[:, None] * information * root
    factor = np.linalg.cholesky(matrix)
    reduced = np.linalg.solve(factor, root * score)
    mean = root * np.linalg.solve(factor.T, reduced)
    gain = 0.5 * float(reduced @ reduced) - float(np.sum(np.log(np.diag(factor))))
    explained = float(2 * mean @ score - mean @ information @ mean)
    return FunctionEvidence(gain, explained, variance)


def best_evidence(information: Array, score: Array, orders: Array, size: float, copies: int = 1) -> FunctionEvidence:
    """The largest evidence over the grid of ``LENGTHS`` (shares of the span) and ``SIZES`` (shares of ``size``).

    Parameters
    ----------
    information, score : (n, n) A and (n,) g, as in ``function_evidence``.
    orders : (n / copies,) orders of the cosines of one function. size : plausible amplitude of the function.
    copies : number of functions with the same size and length, whose coefficients are concatenated.
    """
    tried = [
        function_evidence(information, score, np.tile((factor * size) ** 2 * spectrum(orders, length), copies))
        for length in LENGTHS
        for factor in SIZES
    ]
    return max(tried, key=lambda one: one.gain)
