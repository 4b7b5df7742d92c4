"""Whether a logged acceleration is computed from the logged speed, so that it does not measure the slope.

Receivers and lap timers write the rate of change of their speed as a longitudinal acceleration. An accelerometer in a
coast has noise of its own; a derivative has that of the speed. With the slow motion of the coast subtracted from both::

    a_k = sum_j c_j V_(k+j) + e_k,  |j| <= TAPS

by least squares over all coasts, for any filter of the logger up to this length. The share of the variance of a that
the speed explains is nearly one for a derivative, and near zero for a sensor.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.io.clocks.block_means import condensed
from vdyn_cli.quantities.arrays import Array, filled
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

RATE = 100.0  # Hz, to which faster logs are averaged: receivers have 1 to 100 Hz
SLOW = 2.0  # s, over which a coast's motion is smooth
FEWEST_OF_SLOW = 9  # samples of that time in a slow log
TAPS = 10  # samples before and after, of a logger's filter
FEWEST_ROWS = 6  # for each coefficient
LEAST_NOISE = 0.01  # m/s^2, below which no vehicle vibrates: a simulated log has no noise to compare


def derived_finding(coasts: Sequence[Log]) -> Finding | None:
    """The finding that the acceleration of these coasts is computed from their speed; None if it is not.

    Parameters
    ----------
    coasts : SI, each with the channels speed and acceleration.
    """
    parts = [p for log in coasts if (p := _rows(condensed(log, RATE))) is not None]
    if sum(y.size for _, y in parts) < FEWEST_ROWS * (2 * TAPS + 1):
        return None
    x, y = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
    if np.std(y) < LEAST_NOISE:
        return None
    left = y - x @ np.linalg.lstsq(x, y, rcond=None)[0]
    share = 1.0 - float(left @ left) / float(y @ y)
    if share < COASTDOWN_POLICY.derived_acceleration:
        return None
    what = (
        f"not used: it is computed from the speed, whose noise explains {100 * share:.0f} % of its own; it does not "
        "measure the slope of the road"
    )
    return Finding("channels.acceleration", what, remedy="map the acceleration of an accelerometer, or remove it")


def _rows(log: Log) -> tuple[Array, Array] | None:
    """The rapid parts of the speed about each sample, (n, 2 TAPS + 1), and of the acceleration (n,); None if short."""
    window = 2 * max(FEWEST_OF_SLOW, round(SLOW / float(np.median(np.diff(log.time))))) // 2 + 1
    if log.time.size < window + 4 * TAPS:
        return None
    speed, acceleration = (_rapid(filled(log.time, log[n]), window) for n in ("speed", "acceleration"))
    rows = np.lib.stride_tricks.sliding_window_view(speed, 2 * TAPS + 1)
    return rows, acceleration[TAPS:-TAPS]


def _rapid(values: Array, window: int) -> Array:
    """The values (n,) less their mean over a window about each, (n - window + 1,)."""
    means = np.convolve(values, np.full(window, 1.0 / window), mode="valid")
    return values[window // 2 : window // 2 + means.size] - means
