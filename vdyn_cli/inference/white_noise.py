"""White noise: its standard deviation in a recorded channel, and whitening by a covariance."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array, median_deviation, rms

# A channel's variance must exceed that of its white noise by so many of its standard errors, noise^2 (2 / n)^0.5: with
# less, the channel may hold noise alone. Above that, the intervals show how much information the channel holds.
LEAST_EXCESS = 10.0
ROUNDING = 1e-12  # share of a variance
FEWEST_READINGS = 8  # of which the level of white noise can be estimated: five third differences


def white_level(trace: Array, time: Array | None = None) -> float:
    """The standard deviation of the white noise in a smooth trace, from its third differences, in the trace's unit.

    A third difference removes any parabola and multiplies the variance of white noise by 20; the median is robust
    against jumps and outliers. For uneven samples the divided difference is used::

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
    if x.size < FEWEST_READINGS:
        raise ValueError(f"the level of white noise needs at least {FEWEST_READINGS} samples")
    t = np.arange(x.size, dtype=float) if time is None else np.asarray(time, dtype=float)[good]
    at = np.lib.stride_tricks.sliding_window_view(t, 4)
    gaps = at[:, :, None] - at[:, None, :] + np.eye(4)
    weights = 1.0 / gaps.prod(axis=2)
    differences = np.sum(weights * np.lib.stride_tricks.sliding_window_view(x, 4), axis=1)
    differences = differences / np.sqrt(np.sum(weights**2, axis=1))
    level = median_deviation(differences)
    whole = rms(differences)
    return level if level > 1e-9 * whole else whole


def exceeds_noise(spread: float, noise: float, count: int) -> bool:
    """Whether a channel holds more than white noise, however small the excess is.

    spread^2 - noise^2 > 10 noise^2 (2 / n)^0.5, ten standard errors of a variance of white noise

    Parameters
    ----------
    spread : standard deviation of the channel. noise : its white level, in the same unit.
    count : number of samples, n.
    """
    chance = LEAST_EXCESS * noise**2 * float(np.sqrt(2.0 / max(count, 1)))
    return spread**2 - noise**2 > max(chance, ROUNDING * spread**2) and spread > 0.0


def whiten(residual: Array, jacobian: Array, cholesky: Array) -> tuple[Array, Array]:
    """Residual and Jacobian in units of independent noise of variance one, L^-1 r and L^-1 J.

    Parameters
    ----------
    residual : (n,); jacobian : (n, k).
    cholesky : (n, n), lower triangular factor L of the noise covariance C = L L'; (n,), its diagonal, if C is diagonal.
    """
    from scipy.linalg import solve_triangular

    if cholesky.ndim == 1:
        return residual / cholesky, jacobian / cholesky[:, None]
    both = solve_triangular(cholesky, np.column_stack([jacobian, residual]), lower=True)
    return np.ascontiguousarray(both[:, -1]), np.ascontiguousarray(both[:, :-1])
