"""Noise of the moment balance: covariance of the integrated balances, and estimates of the true channels."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.cg.load_windows import LoadWindows
from vdyn_cli.steps.cg.unmeasured_heave import with_heave

# s, standard deviation. The noise that is left is in the derivatives by delays, which differentiate: with 0.015 s, in
# eight clean days a delay of the acceleration scattered by 1.8 times its standard deviation, with 0.03 s by 1.1 times.
# It passes 85 % of the body's motion at 3 Hz; what it does not pass costs efficiency, and does not bias.
SMOOTHING = 0.03


def balance_covariance(windows: LoadWindows, partial: Mapping[str, Array], heave: Array) -> Array:
    """Lower band (b, k) of the covariance A S A' of the integrated balances; neighboring windows share one sample.

    Parameters
    ----------
    partial : derivatives (k,) of each window's mean balance by each channel, the pitch acceleration as ``pitch_rate``.
    heave : autocovariance (m,) of the heave as front load, N^2 (``heave_autocovariance``).
    """
    band = np.zeros((2, windows.first.size))
    adjacent = np.diff(windows.first) == windows.weights.shape[1] - 1
    inner = np.sum(windows.weights**2, axis=1)
    shared = windows.weights[:-1, -1] * windows.weights[1:, 0] * adjacent
    for name in (*windows.loads, "acceleration"):
        p, variance = partial[name], windows.noise[name] ** 2
        band[0] += variance * p**2 * inner
        band[1, :-1] += variance * p[:-1] * p[1:] * shared
    p, variance = partial["pitch_rate"], windows.noise["pitch_rate"] ** 2
    band[0] += 2 * variance * p**2
    band[1, :-1] -= variance * p[:-1] * p[1:] * adjacent
    return with_heave(band, heave, partial["front_load"] * windows.width)


def true_channels(
    windows: LoadWindows, partial: Mapping[str, Array], multiplier: Array, delays: Mapping[str, float]
) -> dict[str, Array]:
    """The most probable true channels (n,) that fulfill the balance, given the measured ones; smoothed.

    x = x_measured - S A' V^-1 g, with S the channels' noise, A the balances' derivatives, V = A S A'

    Parameters
    ----------
    multiplier : V^-1 g, (k,). delays : of the logged loads and acceleration, s.
    """
    from scipy.ndimage import gaussian_filter1d

    true = dict(windows.channels)
    for name in (*windows.loads, "acceleration"):
        change = windows.noise[name] ** 2 * windows.spread(partial[name] * multiplier)
        if delay := delays[name]:  # the reading that entered the balance was taken that much later
            change = np.interp(windows.time - delay, windows.time, change, 0.0, 0.0)
        true[name] = true[name] - change
    ends = np.zeros(windows.time.size)
    np.add.at(ends, windows.first + windows.weights.shape[1] - 1, partial["pitch_rate"] * multiplier)
    np.add.at(ends, windows.first, -partial["pitch_rate"] * multiplier)
    true["pitch_rate"] = true["pitch_rate"] - windows.noise["pitch_rate"] ** 2 * ends
    return {n: np.asarray(gaussian_filter1d(v, SMOOTHING / windows.step, mode="nearest")) for n, v in true.items()}
