"""Averages and slopes of a channel over the second about each sample."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.validate.road.road_slope import SENSED_SLOPE

SPAN = 1.0  # s over which accelerations are taken


def mean_over_span(time: Array, values: Array) -> Array:
    """Average (n,) over the span about each sample."""
    first, last = _window(time)
    total = np.r_[0.0, np.cumsum(values)]
    return np.asarray((total[last] - total[first]) / (last - first))


def slope_over_span(time: Array, values: Array) -> Array:
    """Slope (n,) of the straight line through the span about each sample, by least squares."""
    since = time - time[0]
    t, v, tt, tv = (mean_over_span(time, x) for x in (since, values, since**2, since * values))
    return np.asarray((tv - t * v) / np.maximum(tt - t**2, 1e-12))


def level_rate(time: Array, speed: Array, channels: Mapping[str, Array]) -> Array:
    """The rate of speed (n,), m/s^2, on a level road: V' + g i, without the share of the rotating mass in g i.

    The grade i is the logged one, and what accelerometers show beyond it.

    Parameters
    ----------
    time : (n,) s. speed : (n,) m/s. channels : grade and slopes (n,), as far as they are known.
    """
    rate = slope_over_span(time, speed)
    for name in ("grade", SENSED_SLOPE):
        if name in channels:
            rate = rate + GRAVITY * mean_over_span(time, channels[name])
    return rate


def least_over_span(time: Array, values: Array) -> Array:
    """Least value (n,) in the span about each sample."""
    first, last = _window(time)
    return np.array([values[a:b].min() for a, b in zip(first.tolist(), last.tolist(), strict=True)])


def _window(time: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices (n,) of the first sample, and of the one after the last, of the span about each sample."""
    return np.searchsorted(time, time - SPAN / 2), np.searchsorted(time, time + SPAN / 2, side="right")
