"""Heave of the body on an uneven road, as colored noise of the front load where the rear load is not logged."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.cg.load_windows import WINDOW

SPAN = 1.5  # s, largest lag with a correlation: two periods of a body that heaves at 1.3 Hz
NO_HEAVE: Array = np.zeros(0)


def heave_autocovariance(imbalances: Sequence[Array], sensors: Sequence[Array]) -> Array:
    """Autocovariance (m,), N^2, of the imbalance beyond the sensors' noise, at lags of 0, 1, ... windows.

    Negative values of the spectrum are set to zero, and Bartlett's window keeps it nonnegative.

    Parameters
    ----------
    imbalances : for each run, each window's mean imbalance as front axle load (k,), N.
    sensors : for each run, lower band (2, k) of their covariance by the sensors' noise, N^2.

    Assumes that the runs' windows are equally long and nearly all adjoin.
    """
    lags = min(round(SPAN / WINDOW), *(e.size for e in imbalances))
    total, count = np.zeros(lags), 0
    for imbalance, band in zip(imbalances, sensors, strict=True):
        off = imbalance - imbalance.mean()
        total += [float(off[: off.size - j] @ off[j:]) for j in range(lags)]
        total[:2] -= band.sum(axis=1)
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
