"""Heave of the body where the rear load is not logged: caused by pitch, or by an uneven road as colored noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.arrays import Array

# Heave of a passenger car's body: 1 to 1.5 Hz, damping ratio 0.2 to 0.4 (Gillespie, Fundamentals of Vehicle Dynamics,
# 1992). For a body of 2.3 Hz, both levers together still describe half of the heave that pitching causes.
FREQUENCY, DAMPING = 1.3, 0.3  # Hz, -
LONGEST_LAG = 1.5  # s, largest lag with a correlation: two periods of a body that heaves at 1.3 Hz
NO_HEAVE: Array = np.zeros(0)


def pitch_heave(time: Array, pitch_rate: Array) -> tuple[Array, Array]:
    """Heave acceleration (n,) per meter of lever, by the springs and by the dampers, m/s^2 per m.

    z'' + 2 D w z' + w^2 z = w^2 e_k th + 2 D w e_c th'

    The levers e_k = (lr kr - lf kf)/(kf + kr), and e_c likewise, are the distances of the centers of springs and
    dampers behind the center of gravity.

    Parameters
    ----------
    time : (n,), s. pitch_rate : (n,), rad/s, nose-up.

    Assumes that the body is at rest on its springs at the start, and that the samples are nearly equidistant.
    """
    from scipy.signal import bilinear, lfilter

    w = 2 * np.pi * FREQUENCY
    swing = [1.0, 2 * DAMPING * w, w**2]
    per_second = 1.0 / float(np.median(np.diff(time)))
    sprung, damped = (
        np.asarray(lfilter(*bilinear(drive, swing, per_second), pitch_rate))
        for drive in ([w**2, 0.0], [2 * DAMPING * w, 0.0, 0.0])
    )
    return sprung, damped


def heave_autocovariance(imbalances: Sequence[Array], sensors: Sequence[Array], window: float) -> Array:
    """Autocovariance (m,), N^2, of the imbalance beyond the sensors' noise, at lags of 0, 1, ... windows.

    R_j = (1 - j/m) (sum e_k e_(k+j) - b_j) / n,   j < m

    with e the imbalance without its mean, b the sensors' part (sum of the band), n the number of windows, and m windows
    in ``LONGEST_LAG``. Negative values of the spectrum are set to zero; Bartlett's window 1 - j/m keeps it nonnegative.

    Parameters
    ----------
    imbalances : for each run, each window's mean imbalance as front axle load (k,), N.
    sensors : for each run, lower band (b, k) of their covariance by the sensors' noise, N^2.
    window : length of a window, s.

    Assumes that the runs' windows are equally long and nearly all adjoin.
    """
    lags = min(round(LONGEST_LAG / window), *(e.size for e in imbalances))
    total, count = np.zeros(lags), 0
    for imbalance, band in zip(imbalances, sensors, strict=True):
        off = imbalance - imbalance.mean()
        total += [float(off[: off.size - j] @ off[j:]) for j in range(lags)]
        total[: len(band)] -= band.sum(axis=1)[:lags]
        count += off.size
    even = np.concatenate([total, [0.0], total[:0:-1]]) / count
    spectrum = np.maximum(np.fft.rfft(even).real, 0.0)
    return np.asarray(np.fft.irfft(spectrum, 2 * lags)[:lags] * (1.0 - np.arange(lags) / lags))


def with_heave(band: Array, autocovariance: Array, scale: Array) -> Array:
    """The lower band (b, k) of a covariance of integrated balances plus that of the heave.

    Parameters
    ----------
    scale : (k,), derivative of each integrated balance by the front load.
    """
    total = np.zeros((max(len(band), autocovariance.size), scale.size))
    total[: len(band)] = band
    for j, value in enumerate(autocovariance):
        total[j, : scale.size - j] += value * scale[: scale.size - j] * scale[j:]
    return total
