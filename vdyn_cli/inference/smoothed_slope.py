"""Kalman smoother of a road's slope from noisy measurements along the distance.

The slope is an Ornstein-Uhlenbeck process over the distance, i(x + d) = i(x) exp(-d/length) + innovation, of standard
deviation ``size``; each measurement adds white noise. Size, length and noise maximize the likelihood of the
measurements over a coarse and then a finer grid. The smoothed slope is the process' mean given all measurements (Kalman
filter forward, Rauch-Tung-Striebel smoother back). Its error is independent of its value, so that a regression on it
has no attenuation bias (errors in variables), unlike one on the noisy measurements.

Source: Rauch, Tung and Striebel, AIAA Journal 3 (1965) 1445.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array

SIZES = tuple(np.geomspace(0.0015, 0.03, 6))
LENGTHS = tuple(np.geomspace(30.0, 1500.0, 7))  # m
NOISES = tuple(np.geomspace(0.0005, 0.03, 8))  # of a measurement, as a slope
SIGNIFICANT = 10.0  # log likelihood ratio above which hills are significant: below it noise would be used as slope
FINER = tuple(np.geomspace(0.6, 1.67, 7))  # factors on the best point of the grid


def smoothed_slope(along: Array, measured: Array, used: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Mean and standard deviation of the slope at each measurement, (k,) each, by the module's Kalman smoother.

    The mean is zero where hills are not significant: where the log likelihood exceeds that of a level road with white
    noise by less than ``SIGNIFICANT``.

    Parameters
    ----------
    along : (k,) m, increasing positions. measured : (k,) slopes, -. used : (k,) whether a measurement is used.
    """
    best = np.ones(3)
    for axes in ((SIZES, LENGTHS, NOISES), (FINER, FINER, FINER)):
        grid = best * np.array(list(product(*axes)))
        likelihood = _filtered(along, measured, used, grid)[0]
        best = grid[int(np.argmax(likelihood))]
    if float(np.max(likelihood)) - _level_road_likelihood(measured[used]) < SIGNIFICANT:
        return np.zeros(along.size), np.full(along.size, best[0])
    _, mean, variance = _filtered(along, measured, used, best[None])
    return _smoothed(along, mean[:, 0], variance[:, 0], best)


def _level_road_likelihood(measured: Array) -> float:
    """Log likelihood of a level road with white measurement noise, up to the constant that ``_filtered`` omits."""
    spread = max(float(np.mean(measured**2)), 1e-12) if measured.size else 1.0
    return -0.5 * measured.size * (float(np.log(spread)) + 1.0)


def _filtered(along: Array, measured: Array, used: NDArray[np.bool_], grid: Array) -> tuple[Array, Array, Array]:
    """Log likelihood (g,) of each row (size, length, noise) of the grid, and filtered mean and variance (k, g)."""
    prior, length, noise = grid[:, 0] ** 2, grid[:, 1], grid[:, 2] ** 2
    mean, variance, likelihood = np.zeros(len(grid)), prior.copy(), np.zeros(len(grid))
    means, variances = np.empty((along.size, len(grid))), np.empty((along.size, len(grid)))
    steps = np.diff(along, prepend=along[0])
    for k in range(along.size):
        kept = np.exp(-steps[k] / length)
        mean, variance = kept * mean, kept**2 * variance + (1.0 - kept**2) * prior
        if used[k]:
            spread, off = variance + noise, measured[k] - mean
            likelihood -= 0.5 * (np.log(spread) + off**2 / spread)
            gain = variance / spread
            mean, variance = mean + gain * off, variance * (1.0 - gain)
        means[k], variances[k] = mean, variance
    return likelihood, means, variances


def _smoothed(along: Array, mean: Array, variance: Array, found: Array) -> tuple[Array, Array]:
    prior, length = found[0] ** 2, found[1]
    kept = np.exp(-np.diff(along) / length)
    mean, variance = mean.copy(), variance.copy()
    for k in range(along.size - 2, -1, -1):
        ahead = kept[k] ** 2 * variance[k] + (1.0 - kept[k] ** 2) * prior
        gain = kept[k] * variance[k] / ahead
        mean[k] += gain * (mean[k + 1] - kept[k] * mean[k])
        variance[k] += gain**2 * (variance[k + 1] - ahead)
    return mean, np.sqrt(variance)
