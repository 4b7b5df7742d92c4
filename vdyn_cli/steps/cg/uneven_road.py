"""Noise of the moment balance by axles that an uneven road moves, where both axles' loads are logged."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.cg.policy import CG_POLICY
from vdyn_cli.steps.step_policy import STEP_POLICY

LOWEST = 3.0  # Hz, above the driver's pedals
# Hz, at which the logger's filter, or the contact patch, may end the road's spectrum; the last one is none.
CUTOFFS = (*np.geomspace(5.0, 40.0, 10), np.inf)
ROUNDS = 20  # of the weighted fit of the road's amplitude, which needs five to ten
LAGS = 16  # windows of 20 ms: with the lowest cutoff, 0.1 % of the autocovariance is left
AXLE_SHARE = 0.05  # of the vehicle's mass, that an axle has: 0.04 to 0.08
SMOOTH: Array = np.zeros(0)  # the autocovariance on a smooth road


def uneven_road(imbalances: Sequence[Array], sensors: Sequence[Array], window: float, mass: float) -> Array:
    """Autocovariance (m,), N^2, of the imbalance by an uneven road at lags of 0, 1, ... windows; (0,) on a smooth road.

    An axle of mass m on tires of stiffness Kt moves by z = u - F / Kt on a road of height u. The load shows F alone: m
    u'' is noise. The slope of a road is nearly white (ISO 8608), hence u' too, and in a window of length T u' changes
    by the difference of two values. The spectrum is

    q (2 - 2 cos(2 pi f T)) / (1 + (f / fc)^4)

    with the amplitude q and the cutoff fc most likely for the imbalance above ``LOWEST`` (Whittle's likelihood), beside
    the sensors' noise.

    Parameters
    ----------
    imbalances : for each run, each window's mean imbalance as front axle load (k,), N.
    sensors : for each run, lower band (b, k) of their covariance by the sensors' noise, N^2.
    window : length of a window, s. mass : of the vehicle, kg.

    Assumes that the runs' windows are equally long and nearly all adjoin.
    """
    found = [_spectra(e, band, window) for e, band in zip(imbalances, sensors, strict=True)]
    frequency, power, sensor = np.concatenate(found, axis=1)
    fits = [_amplitude(power, sensor, _shape(frequency, window, cutoff)) for cutoff in CUTOFFS]
    best = int(np.argmax([gain for _, gain in fits]))
    q, gain = fits[best]
    least = AXLE_SHARE * mass * CG_POLICY.smoothest_road / window
    if gain < STEP_POLICY.uneven_road or q < least**2:
        return SMOOTH
    frequency = np.asarray(np.fft.rfftfreq(4 * LAGS, window), float)
    whole = q * _shape(frequency, window, CUTOFFS[best])
    return np.asarray(np.fft.irfft(whole)[:LAGS])


def _shape(frequency: Array, window: float, cutoff: float) -> Array:
    """The road's spectrum for q = 1."""
    return np.asarray((2 - 2 * np.cos(2 * np.pi * frequency * window)) / (1 + (frequency / cutoff) ** 4))


def _amplitude(power: Array, sensor: Array, road: Array) -> tuple[float, float]:
    """The most likely q, and the log-likelihood that it gains."""
    q = 0.0
    for _ in range(ROUNDS):
        weight = (road / (sensor + q * road)) ** 2
        q = max(0.0, float(weight @ ((power - sensor) / road) / weight.sum()))
    rough = sensor + q * road
    return q, float(np.sum(np.log(sensor / rough) + power / sensor - power / rough))


def _spectra(imbalance: Array, band: Array, window: float) -> Array:
    """Frequencies (f,) above ``LOWEST``, with the spectra of one run's imbalance and of the sensors' noise, (3, f)."""
    taper = np.hanning(imbalance.size)
    frequency = np.fft.rfftfreq(imbalance.size, window)
    inside = frequency >= LOWEST
    power = np.abs(np.fft.rfft((imbalance - imbalance.mean()) * taper)) ** 2 / float(taper @ taper)
    variance, *shared = band.mean(axis=1)
    sensor = variance + sum(2 * s * np.cos(2 * np.pi * frequency * (j + 1) * window) for j, s in enumerate(shared))
    return np.array([frequency, power, sensor])[:, inside]
