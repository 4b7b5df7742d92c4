"""First-order lags of signals, with exact derivatives."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array


def lagged_rate(time: Array, value: Array, rate: Array, lag: float) -> tuple[Array, Array]:
    """The rate of a signal that follows another with a first-order lag, and its derivative to the lag.

    lag r' + r = x',   so that y = x - lag r follows x:   lag y' + y = x

    Parameters
    ----------
    time : (n,) s. value, rate : (n, k), x and x' of k signals; cubic between samples.
    lag : s, the time constant. If negative, x is the lagged signal, and y = x - lag x' is the signal that it follows.

    Returns
    -------
    (n, k) r and (n, k) dr/dlag. Initial value: steady state for a ramp with the signal's initial slope.
    """
    from scipy.linalg import solve_banded

    if lag < 0.0 or time.size < 2:
        return rate, np.zeros_like(rate)
    step = np.diff(time)[:, None]
    kept = np.exp(-step / lag) if lag else np.zeros_like(step)
    moved = kept * step / lag**2 if lag else np.zeros_like(step)  # d kept / d lag
    # In each step x' is a quadratic d + b u + c u^2, with the particular solution p = x' - lag x'' + lag^2 x'''.
    first, last, mean = rate[:-1], rate[1:], np.diff(value, axis=0) / step
    b, twice_c = (6.0 * mean - 4.0 * first - 2.0 * last) / step, 6.0 * (first + last - 2.0 * mean) / step**2
    begun, ended = first - lag * b + lag**2 * twice_c, last - lag * (b + twice_c * step) + lag**2 * twice_c
    slope_begun, slope_ended = 2.0 * lag * twice_c - b, 2.0 * lag * twice_c - b - twice_c * step
    band = np.ones((2, time.size))
    band[1, :-1] = -kept[:, 0]
    followed, change = rate.copy(), np.zeros_like(rate)
    followed[1:] = ended - kept * begun
    followed = solve_banded((1, 0), band, followed)
    change[1:] = slope_ended - kept * slope_begun + moved * (followed[:-1] - begun)
    return followed, solve_banded((1, 0), band, change)
