"""White noise: its level in a recorded channel, and rows whitened by a covariance."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array

# standard errors of the variance of white noise, noise^2 (2 / n)^0.5, by which a channel's must exceed it: below,
# the channel may hold noise alone. Beyond, the intervals say what it tells.
LEAST_EXCESS = 10.0
ROUNDING = 1e-12  # of a variance
NORMAL_FROM_MEDIAN = 1.482602218505602  # standard deviation of a normal variable per median absolute value


def white_level(trace: Array, time: Array | None = None) -> float:
    """The standard deviation of the white noise in a smooth trace, from its third differences.

    A third difference removes what a parabola describes and leaves white noise 20 times its variance; the median
    keeps jumps and outliers out. For uneven samples the divided difference takes its place::

        d_i = sum_j c_j x_(i+j),  c_j = 1 / prod_(l != j) (t_j - t_l),   level = 1.4826 median |d_i| / |c|

    Parameters
    ----------
    trace : (n,), the recorded channel, n >= 8; NaN are skipped.
    time : (n,), its increasing time in s where the samples are uneven.

    Assumes that the signal has little curvature within four samples. A channel quantized so coarsely that most
    differences vanish falls back to their root mean square.

    Raises
    ------
    ValueError
        Fewer than eight samples.
    """
    good = np.isfinite(trace)
    x = np.asarray(trace, dtype=float)[good]
    if x.size < 8:
        raise ValueError("the level of white noise needs at least eight samples")
    t = np.arange(x.size, dtype=float) if time is None else np.asarray(time, dtype=float)[good]
    at = np.lib.stride_tricks.sliding_window_view(t, 4)
    gaps = at[:, :, None] - at[:, None, :] + np.eye(4)
    weights = 1.0 / gaps.prod(axis=2)
    differences = np.sum(weights * np.lib.stride_tricks.sliding_window_view(x, 4), axis=1)
    differences = differences / np.sqrt(np.sum(weights**2, axis=1))
    level = NORMAL_FROM_MEDIAN * float(np.median(np.abs(differences)))
    whole = float(np.sqrt(np.mean(differences**2)))
    return level if level > 1e-9 * whole else whole


def exceeds_noise(spread: float, noise: float, count: int) -> bool:
    """Whether a channel holds more than white noise, however small it is.

    spread^2 - noise^2 > 10 noise^2 (2 / n)^0.5

    Parameters
    ----------
    spread : standard deviation of the channel. noise : its white level, in the same unit.
    count : number of samples, n.
    """
    chance = LEAST_EXCESS * noise**2 * float(np.sqrt(2.0 / max(count, 1)))
    return spread**2 - noise**2 > max(chance, ROUNDING * spread**2) and spread > 0.0


def whiten(
    residual: Array, jacobian: Array, *, covariance: Array | None = None, cholesky: Array | None = None
) -> tuple[Array, Array]:
    """Residual and Jacobian in units of independent noise of variance one.

    With the noise covariance C = L L', returns L^-1 r and L^-1 J.

    Parameters
    ----------
    residual : (n,); jacobian : (n, k).
    covariance : (n, n), or instead cholesky : (n, n), its lower triangular factor L.

    Raises
    ------
    ValueError
        Neither or both are given, or the covariance is not positive definite.
    """
    from scipy.linalg import LinAlgError, solve_triangular
    from scipy.linalg import cholesky as factor

    if (covariance is None) == (cholesky is None):
        raise ValueError("whiten needs either the covariance or its Cholesky factor")
    try:
        root = factor(covariance, lower=True) if covariance is not None else np.asarray(cholesky)
    except LinAlgError as error:
        raise ValueError("the noise covariance is not positive definite") from error
    both = solve_triangular(root, np.column_stack([jacobian, residual]), lower=True)
    return np.ascontiguousarray(both[:, -1]), np.ascontiguousarray(both[:, :-1])
