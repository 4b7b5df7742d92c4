"""Heave of the body on an uneven road: where the rear load is not logged, colored noise of the front load."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.cg.load_windows import WINDOW

SPAN = 1.5  # s of lags, beyond which it is taken as uncorrelated: two swings of a body that heaves at 1.3 Hz
NO_HEAVE: Array = np.zeros(0)


def heave_autocovariance(imbalances: Sequence[Array], sensors: Sequence[Array]) -> Array:
    """Autocovariance (m,), N^2, of what the balance leaves beyond the sensors' noise, at lags of 0, 1, ... windows.

    The spectrum is not negative: what the sensors' noise exceeds is cut to zero, and Bartlett's window keeps it so.

    Parameters
    ----------
    imbalances : of each run, each window's mean imbalance as front axle load (k,), N.
    sensors : of each run, lower band (2, k) of the covariance of those by the sensors' noise, N^2.

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
    """The lower band of a covariance of integrated balances (b, k), and that of the heave added.

    Parameters
    ----------
    scale : (k,), derivative of each integrated balance to the front load.
    """
    total = np.zeros((max(len(band), autocovariance.size), scale.size))
    total[: len(band)] = band
    for j, value in enumerate(autocovariance):
        total[j, : scale.size - j] += value * scale[: scale.size - j] * scale[j:]
    return total
