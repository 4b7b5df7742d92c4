"""Gravity's component along the road in an accelerometer's signal, from a logged elevation.

An accelerometer measures the specific force V' + g sin(slope). On hills the slope is correlated with the acceleration
over a drive by chance, so that the gain of the signal over the change of the speed differs from 1 by up to a tenth.
"""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array, cumulative_integral, filled
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.log import Log

PLACE = 20.0  # m over which elevations are averaged: a road's slope hardly changes, a receiver's noise averages out
FEWEST_PLACES = 8
FEWEST_WINDOWS = 10  # windows of a second


def without_road_gravity(log: Log, speed: str) -> Log:
    """The log whose acceleration is without gravity's component by the elevation.

    The log as it is without an elevation, and where the correlation with the change of the speed over a second is not
    larger without gravity: the acceleration is then not a specific force, or the elevation is too inaccurate.

    Parameters
    ----------
    speed : name of the channel, m/s.
    """
    if "elevation" not in log:
        return log
    known = np.isfinite(log["acceleration"]) & np.isfinite(log[speed])
    gravity = _road_gravity(log, speed)
    time = log.time[known]
    ends = np.searchsorted(time, np.arange(time[0], time[-1], 1.0)) if time.size > 1 else np.zeros(0, dtype=int)
    if gravity is None or ends.size < FEWEST_WINDOWS:
        return log
    change = np.diff(log[speed][known][ends])
    alone, rest = (
        _correlation(change, np.diff(cumulative_integral(time, a[known])[ends]))
        for a in (log["acceleration"], log["acceleration"] - gravity)
    )
    return log.with_channels(acceleration=log["acceleration"] - gravity) if rest > alone else log


def _correlation(x: Array, y: Array) -> float:
    x, y = x - x.mean(), y - y.mean()
    return abs(float(x @ y)) / max(float(np.sqrt((x @ x) * (y @ y))), 1e-300)


def _road_gravity(log: Log, speed: str) -> Array | None:
    """g times the slope (n,) m/s^2 at the samples, uphill positive; None if few places of the road are known."""
    if np.isfinite(log[speed]).sum() < FEWEST_PLACES:
        return None
    place = cumulative_integral(log.time, filled(log.time, log[speed]))
    height = log["elevation"]
    known = np.isfinite(height)
    group, count = np.unique(np.floor(place[known] / PLACE), return_inverse=True, return_counts=True)[1:]
    if count.size < FEWEST_PLACES:
        return None
    at, mean = (np.bincount(group, values[known]) / count for values in (place, height))
    return np.asarray(GRAVITY * np.interp(place, at, np.gradient(mean, at)))
