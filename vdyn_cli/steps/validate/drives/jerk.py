"""Jerk from a noisy specific force, by the same smoothing derivative for measured and simulated.

The derivative of a Gaussian of standard deviation tau is a low-pass (3 dB at 0.133/tau) and a differentiator at once::

    j(t) = sum a(t_i) k'(t - t_i) dt,   k = exp(-t^2/(2 tau^2)) / (tau sqrt(2 pi))

White noise s of samples dt apart becomes s sqrt(dt / (4 sqrt(pi) tau^3)). Source: derivative of a Gaussian, Canny, IEEE
Trans. Pattern Analysis and Machine Intelligence 8 (1986) 679.
"""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array

WIDTH = 0.02  # s, tau
CORNER = float(np.sqrt(np.log(2.0)) / (2 * np.pi * WIDTH))  # Hz, 3 dB
SLOWEST_RATE = 40.0  # Hz, least rate of the logger at which a jerk shows oscillations of the driveline


def noise_gain(time: Array) -> float:
    """Standard deviation, 1/s, of the filtered derivative of unit white noise sampled at ``time`` (n,), s.

    sqrt(dt / (4 sqrt(pi) tau^3)), dt the median step and tau = ``WIDTH``; for the filter see the head of the module.
    """
    spacing = float(np.median(np.diff(time)))
    return float(np.sqrt(spacing / (4 * np.sqrt(np.pi) * WIDTH**3)))


def samples_alike(time: Array) -> float:
    """Number of samples per independent sample of filtered noise: the sum of squared correlations.

    rho(t) = (1 - t^2 / (2 tau^2)) exp(-t^2 / (4 tau^2)) at lags t of whole steps of ``time`` (n,), s
    """
    spacing = float(np.median(np.diff(time)))
    lag = np.arange(-200, 201) * spacing / WIDTH
    return float(np.sum(((1.0 - 0.5 * lag**2) * np.exp(-0.25 * lag**2)) ** 2))


def resolves_jerk(time: Array) -> bool:
    """Whether a clock (n,), s, is fast enough for a jerk: its median step is at most 1 / SLOWEST_RATE."""
    return float(np.median(np.diff(time))) <= 1.0 / SLOWEST_RATE


def low_passed(time: Array, values: Array) -> Array:
    """Values (n,) or (n, k) at times (n,), s, through the Gaussian low-pass; NaN in its reach gives NaN."""
    at = _lags(time)
    kernel = _gaussian(at)
    return _filtered(time, values, kernel / kernel.sum())


def smooth_derivative(time: Array, values: Array) -> Array:
    """Time derivative of values (n,) or (n, k) at times (n,), s, through the Gaussian low-pass, unit 1/s.

    The convolution with k' of the module's equation, scaled to be exact for straight lines and cut off at four standard
    deviations (tau = 0.02 s, 3 dB at 6.6 Hz). NaN within reach of the filter gives NaN.
    """
    at = _lags(time)
    kernel = -at * _gaussian(at)
    return _filtered(time, values, kernel / -np.sum(at * kernel))


def _lags(time: Array) -> Array:
    """Times of the filter's samples about its middle, s."""
    spacing = float(np.median(np.diff(time)))
    reach = int(np.ceil(4 * WIDTH / spacing))
    return np.asarray(np.arange(-reach, reach + 1) * spacing)


def _gaussian(lag: Array) -> Array:
    return np.asarray(np.exp(-0.5 * (lag / WIDTH) ** 2))


def _filtered(time: Array, values: Array, kernel: Array) -> Array:
    """The convolution with a kernel on an even grid of the clock's median step, at the times of the clock."""
    from scipy.ndimage import convolve1d

    spacing = float(np.median(np.diff(time)))
    even = np.arange(time[0], time[-1] + 0.5 * spacing, spacing)
    columns = values.reshape(values.shape[0], -1)
    grid = np.column_stack([np.interp(even, time, c) for c in columns.T])
    smooth = convolve1d(grid, kernel, axis=0, mode="nearest")
    back = np.column_stack([np.interp(time, even, c) for c in smooth.T])
    return np.asarray(back.reshape(values.shape))
