"""The acceleration of a half-shaft's inner end from the logged motor speed, and its noise.

It is the slope of a cubic that is fitted to the speeds within ``REACH`` s: at 20 Hz it is 2 % too small, and its noise
is a tenth of that of differences at 1 kHz, which would exceed the acceleration in a tip-in.
"""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array

REACH = 0.01  # s to either side, or two samples where these are farther
EVEN = 0.5  # relative deviation of a time step from their median, above which only the next samples are used


def acceleration(time: Array, speed: Array) -> Array:
    """Angular acceleration (n,), rad/s^2.

    Parameters
    ----------
    time : (n,), s. speed : (n,), rad/s; empty where it is not logged: the acceleration is then zero.
    """
    if not speed.size:
        return np.zeros(time.size)
    found, weights, step = np.gradient(speed, time), slope_weights(time), np.diff(time)
    if weights.size > time.size:
        return np.asarray(found)
    near = np.convolve(np.abs(step / np.median(step) - 1.0) > EVEN, np.ones(weights.size - 1), "valid") == 0
    by_number = [np.correlate(signal, weights, "valid") for signal in (speed, time)]
    inner = slice(weights.size // 2, -(weights.size // 2))
    found[inner] = np.where(near, by_number[0] / by_number[1], found[inner])
    return np.asarray(found)


def slope_weights(time: Array) -> Array:
    """Weights, an odd number, of the samples around one in the slope per sample there, by the cubic."""
    from scipy.signal import savgol_coeffs

    reach = max(2, round(REACH / float(np.median(np.diff(time)))))
    return np.asarray(savgol_coeffs(2 * reach + 1, 3, deriv=1, use="dot"))


def by_speed(time: Array, pulls: Array) -> Array:
    """Derivatives (n,) by the speed of a sum of accelerations with weights ``pulls`` (n,), of equidistant samples."""
    from_neighbors = np.convolve(pulls, slope_weights(time))
    reach = (from_neighbors.size - pulls.size) // 2
    return np.asarray(from_neighbors[reach : reach + pulls.size] / np.median(np.diff(time)))


def autocovariance(time: Array, speed_noise: float) -> Array:
    """Covariances of accelerations 0, 1, 2, ... equidistant samples apart, (rad/s^2)^2.

    ``speed_noise`` : standard deviation of the speed's white noise, rad/s.
    """
    weights = slope_weights(time)
    products = np.correlate(weights, weights, "full")[weights.size - 1 :]
    return np.asarray(products * (speed_noise / np.median(np.diff(time))) ** 2)
