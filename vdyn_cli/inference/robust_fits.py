"""Linear fits of columns of any units: least squares, and fits that outliers hardly affect (reweighted)."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array, median_deviation

ABSOLUTE_ROUNDS = 30  # reweightings for least absolute deviations
HUBER_ROUNDS = 10  # reweightings with Huber's weights
HUBER = 1.345  # standard deviations: 95 % efficient for normal noise


def ordinary_least_squares(columns: Array, y: Array) -> tuple[Array, Array]:
    """Coefficients (k,) of least squares, and the residual (n,).

    Parameters
    ----------
    columns : (n, k), of any units. y : (n,).
    """
    scale = _scales(columns)
    found = np.linalg.lstsq(columns / scale, y, rcond=None)[0] / scale
    return np.asarray(found), np.asarray(y - columns @ found)


def least_squares_with_prior(
    y: Array, columns: Array, variance: Array, mean: Array, prior: Array
) -> tuple[float, Array, Array]:
    """Least sum of squares, in variances, with a prior of the coefficients (k,); these; and their covariance (k, k).

    Parameters
    ----------
    y : (n,). columns : (n, k). variance : (n,) of y. mean, prior : (k,) mean and standard deviation of the prior.
    """
    rows = np.vstack([columns / np.sqrt(variance)[:, None], np.diag(1.0 / prior)])
    right = np.r_[y / np.sqrt(variance), mean / prior]
    found = np.linalg.lstsq(rows, right, rcond=None)[0]
    residual = right - rows @ found
    return float(residual @ residual), np.asarray(found), np.asarray(np.linalg.inv(rows.T @ rows))


def _scales(columns: Array) -> Array:
    """Rms (k,) of each column, by which it is divided so that units do not matter."""
    return np.asarray(np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-300))


def least_absolute_deviations(design: Array, values: Array) -> Array:
    """Coefficients (k,) of least absolute deviations; residuals below 1e-3, in the unit of the values, weigh alike.

    Parameters
    ----------
    design : (n, k). values : (n,).
    """
    weight = np.ones(values.size)
    for _ in range(ABSOLUTE_ROUNDS):
        root = np.sqrt(weight)
        law = np.linalg.lstsq(design * root[:, None], values * root, rcond=None)[0]
        weight = 1.0 / np.maximum(np.abs(values - design @ law), 1e-3)
    return np.asarray(law)


def huber_fit(columns: Array, y: Array) -> tuple[Array, float]:
    """Coefficients (k,) with Huber's weights, and the standard deviation of the residual by its median.

    min sum rho(y - columns b): rho quadratic up to ``HUBER`` standard deviations, and linear beyond.

    Parameters
    ----------
    columns : (n, k), of any units. y : (n,).

    Source: Huber, Annals of Mathematical Statistics 35 (1964) 73.
    """
    scale = _scales(columns)
    weight, scatter = np.ones(y.size), 0.0
    found = np.zeros(columns.shape[1], dtype=np.float64)
    for _ in range(HUBER_ROUNDS):
        root = np.sqrt(weight)
        found = np.linalg.lstsq(columns / scale * root[:, None], y * root, rcond=None)[0].astype(np.float64)
        left = y - columns / scale @ found
        scatter = median_deviation(left - np.median(left))
        weight = 1.0 / np.maximum(np.abs(left) / max(HUBER * scatter, 1e-12), 1.0)
    return found / scale, scatter
