"""Gaps of a log's clock: steps that are much longer than usual, where the logger paused or lost samples."""

from __future__ import annotations

import numpy as np

from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.arrays import Array, Rows

FEWEST_STEPS = 20  # from which a usual step and its scatter are known


def clock_gaps(time: Array) -> Rows:
    """The samples after which the clock steps by more than its median m plus ``longest_step`` times the larger of m and
    the scatter (5 to 95 %) of the steps.

    Parameters
    ----------
    time : (n,) s, increasing.
    """
    steps = np.diff(time)
    if steps.size < FEWEST_STEPS:
        return np.empty(0, dtype=np.intp)
    low, usual, high = np.quantile(steps, (0.05, 0.5, 0.95))
    return np.flatnonzero(steps > usual + QUALITY.longest_step * max(usual, high - low))
