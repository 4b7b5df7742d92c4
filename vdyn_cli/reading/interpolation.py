"""A slower sensor whose values were joined by straight lines on a faster clock: which rows are its own.

Between its own rows it says nothing new: what looks like a hundred quiet samples are ten noisy ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

MOST = 100_000  # rows that are looked at
STAIRS = 0.8  # of the steps that are none: a coarse channel, which bends wherever it rises
FEWEST = 30  # own rows that show it
SLOWEST = 60  # rows from one own row to the next, at most
SHARPER = 2.5  # most own rows must bend by so much more than any others
ROUNDED = 1.5  # steps of the resolution that rounding bends a straight line by, on average, at most


def own_rows(values: Array) -> Rows | None:
    """The rows (m,) at which an interpolated channel (n,) has values of its own; None where it is not interpolated.

    Its second difference vanishes, but for rounding, everywhere except at every k-th row, k >= 2.
    """
    steps = np.diff(values[:MOST])
    if np.mean(steps == 0.0) > STAIRS:
        return None
    bends = np.abs(np.diff(steps))
    bends = np.where(np.isfinite(bends), bends, 0.0)
    best, own, resolution = SHARPER, None, _resolution(values)
    for k in range(2, min(SLOWEST, bends.size // FEWEST) + 1):
        turns = bends[: bends.size // k * k].reshape(-1, k)
        means = turns.mean(axis=0)
        first = int(np.argmax(means))
        others, most = float(np.delete(means, first).max()), float(np.median(turns[:, first]))
        if most > best * others and others < ROUNDED * resolution:
            best, own = most / max(others, 1e-300), np.arange((first + 1) % k, values.size, k, dtype=np.intp)
    return own


def _resolution(values: Array) -> float:
    """The smallest step between neighbours, at least what floating point leaves of a straight line."""
    known = values[np.isfinite(values)]
    steps, least = np.abs(np.diff(known)), 1e-11 * float(np.abs(known).max(initial=0.0))
    return float(steps[steps > least].min(initial=np.inf)) if np.any(steps > least) else 0.0
