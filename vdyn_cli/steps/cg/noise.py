"""Noise of the moment balance: covariance of the integrated balances, and estimates of the true channels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.cg.load_windows import LoadWindows
from vdyn_cli.steps.cg.local_derivative import SPAN, derivative_reach
from vdyn_cli.steps.cg.unmeasured_heave import NO_HEAVE, with_heave

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# s, standard deviation. The noise that is left is in the derivatives by delays, which differentiate: with 0.015 s, in
# eight clean days a delay of the acceleration scattered by 1.8 times its standard deviation, with 0.03 s by 1.1 times.
# It passes 85 % of the body's motion at 3 Hz; what it does not pass costs efficiency, and does not bias.
SMOOTHING = 0.03


@dataclass(frozen=True)
class NoisyBalance:
    """One run's integrated balances of the measured channels, and their noise.

    Parameters
    ----------
    balance : (k,). scale : (k,), their derivatives by the mean front load.
    by_sample : their derivatives by the samples of each noisy channel (``noise_slopes``).
    band : (b, k), lower band of their covariance by the sensors' noise.
    """

    balance: Array
    scale: Array
    by_sample: Mapping[str, csr_array]
    band: Array

    @property
    def imbalance(self) -> Array:
        """Each window's mean imbalance as front axle load (k,), N."""
        return self.balance / self.scale

    def imbalance_band(self, heave: Array = NO_HEAVE) -> Array:
        """The lower band (b, k) of the imbalances' covariance, N^2, by the sensors and the heave of the body."""
        band = with_heave(self.band, heave, self.scale)
        for j in range(len(band)):
            band[j, : self.scale.size - j] /= self.scale[: self.scale.size - j] * self.scale[j:]
        return band


def noisy_balance(windows: LoadWindows, balance: Array, partial: Mapping[str, Array]) -> NoisyBalance:
    """The integrated balances (k,) of a run with their noise; ``partial`` as in ``noise_slopes``."""
    by_sample = noise_slopes(windows, partial)
    scale = partial["front_load"] * windows.width
    return NoisyBalance(balance, scale, by_sample, balance_covariance(windows, by_sample))


def noise_slopes(windows: LoadWindows, partial: Mapping[str, Array]) -> dict[str, csr_array]:
    """Derivatives (k, n) of the integrated balances by the samples of each noisy channel.

    The derivatives of loads and acceleration are computed from their samples, so that their noise is included.

    Parameters
    ----------
    partial : derivatives (k,) of each window's mean balance by each channel, by the second derivatives of loads and
        acceleration, and the first of the acceleration; the pitch acceleration as ``pitch_rate``.
    """
    from scipy.sparse import diags_array

    slopes = {n: diags_array(partial[n]) @ windows.integral for n in (*windows.loads, "acceleration")}
    for name in (n for n in slopes if partial[f"{n}_bend"].any()):
        slopes[name] += diags_array(partial[f"{name}_bend"]) @ windows.integral_bend
    if partial["acceleration_rate"].any():
        slopes["acceleration"] += diags_array(partial["acceleration_rate"]) @ windows.integral_rate
    return slopes | {"pitch_rate": diags_array(partial["pitch_rate"]) @ windows.change}


def balance_covariance(windows: LoadWindows, slopes: Mapping[str, csr_array]) -> Array:
    """Lower band (b, k) of the covariance A S A' of the integrated balances, A their ``slopes`` (``noise_slopes``)."""
    total = sum(windows.noise[n] ** 2 * (slope @ slope.T) for n, slope in slopes.items())
    samples = 2 * derivative_reach(windows.step, SPAN) + windows.weights.shape[1]  # that a balance depends on
    count = windows.first.size
    band = np.zeros((min((samples - 1) // (windows.weights.shape[1] - 1) + 1, count), count))
    for j, row in enumerate(band):
        row[: count - j] = total.diagonal(-j)
    return band


def true_channels(
    windows: LoadWindows, slopes: Mapping[str, csr_array], multiplier: Array, delays: Mapping[str, float]
) -> dict[str, Array]:
    """The most probable true channels (n,) that fulfill the balance, given the measured ones; smoothed.

    x = x_measured - S A' V^-1 g, with S the channels' noise, A the balances' derivatives, V = A S A'

    Parameters
    ----------
    multiplier : V^-1 g, (k,). delays : of the logged loads and acceleration, s.
    """
    from scipy.ndimage import gaussian_filter1d

    true = dict(windows.channels)
    for name, slope in slopes.items():
        change = windows.noise[name] ** 2 * (slope.T @ multiplier)
        if delay := delays.get(name):  # the reading that entered the balance was taken that much later
            change = np.interp(windows.time - delay, windows.time, change, 0.0, 0.0)
        true[name] = true[name] - change
    return {n: np.asarray(gaussian_filter1d(v, SMOOTHING / windows.step, mode="nearest")) for n, v in true.items()}
