"""Loads and relative rates of the speed of a sweep's bins, without the part that is only noise of their readings."""

from __future__ import annotations

import numpy as np

from vdyn_cli.inference import FEWEST_READINGS, white_level
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log

SCATTERS = 3.0  # standard deviations of a variance, by which that of a varying load exceeds that of the noise
WINDOW = 0.4  # s, standard deviation of the weights of a local slope: some samples of a GPS, a sixth of a slow swell
REACH = 4 * WINDOW  # s, beyond which the weights are negligible
TINY = 1e-12  # s^2, for a time about which there are not two readings


def without_noise(read: Array, variance: Array) -> Array:
    """The most probable true values (n,) of a sweep's bins, from readings (n,) and variances (n,) of their noise.

    With true loads that scatter by t^2 about their mean and readings with the variance v, the true load is on average
    mean + t^2 / (t^2 + v) (read - mean) (regression calibration). Readings of a constant load would be too high where
    Fx / Fz is too low, as if friction decreased with the load. That also holds where they scatter more than their noise
    by chance: t is 0 unless the scatter is ``SCATTERS`` too large.
    """
    noise, whole = float(np.mean(variance)), float(np.var(read))
    by_chance = 1.0 + SCATTERS * (2.0 / max(read.size - 1, 1)) ** 0.5
    scatter = whole - noise if whole > by_chance * noise else 0.0
    share = scatter / (scatter + variance) if scatter > 0.0 else np.zeros_like(variance)
    return np.asarray(read.mean() + share * (read - read.mean()))


def speed_growth(log: Log, time: Array, speed: Array) -> Array:
    """Relative rate (n,) of the vehicle speed, 1/s: V'/V, with V' the slope of a local line.

    A line is fitted to the readings about each time, with normal weights of standard deviation ``WINDOW``; the noise of
    its slope is removed as in ``without_noise``, so that sweeps at constant speed have no rate.

    Parameters
    ----------
    log : vehicle_speed, m/s, NaN for excluded samples. time, speed : (n,) s and m/s, means of the bins.
    """
    clock, read = log.samples.get("vehicle_speed", (log.time, log["vehicle_speed"]))
    good = np.isfinite(read)
    if np.count_nonzero(good) < FEWEST_READINGS:
        return np.zeros_like(speed)
    clock, read = clock[good], read[good]
    noise = white_level(read, clock) ** 2
    slope, variance = np.zeros_like(speed), np.zeros_like(speed)
    first, last = np.searchsorted(clock, time - REACH), np.searchsorted(clock, time + REACH)
    for k, near in enumerate(map(slice, first, last)):
        apart = clock[near] - time[k]
        weight = np.exp(-0.5 * (apart / WINDOW) ** 2)
        lever = weight * (apart - np.sum(weight * apart) / max(float(np.sum(weight)), TINY))
        share = lever / max(float(np.sum(lever * apart)), TINY)
        slope[k], variance[k] = share @ read[near], noise * np.sum(share**2)
    return without_noise(slope, variance) / speed
