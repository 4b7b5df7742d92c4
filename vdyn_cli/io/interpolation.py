"""A slower sensor whose values were joined by straight lines on a faster clock: which rows are its own.

Between its own rows it says nothing new: what looks like a hundred quiet samples is one noisy one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array

Rows = NDArray[np.intp]

MOST = 50_000  # rows that are looked at
STAIRS = 0.8  # of the steps of a channel that moves that are none: a coarse one, which bends wherever it rises
FEWEST = 30  # own rows that show it
SLOWEST = 200  # rows from one own row to the next, at most
SHARPER = 2.5  # most own rows must bend by so much more than any others
ROUNDED = 1.5  # steps of the resolution that rounding bends a straight line by, mostly
WRITTEN = 1e-5  # of the largest value, at least: six digits, or single precision
LEAST_STRAIGHT = 0.2  # of the bends: an interpolated channel has a quarter, half of those between its own rows
ODD = 20.0  # times what most own rows bend: a glitch counts as so much


def own_rows(values: Array) -> Rows | None:
    """The rows (m,) at which an interpolated channel (n,) has values of its own; None where it is not interpolated.

    Its second difference vanishes, except for rounding, everywhere except at every k-th row, k >= 2.
    """
    steps = np.diff(values[:MOST])
    bends = np.abs(np.diff(steps))
    bends = np.where(np.isfinite(bends), bends, 0.0)
    moves = np.flatnonzero(bends)
    if moves.size < FEWEST:
        return None
    first, last = int(moves[0]), int(moves[-1]) + 1
    if np.mean(steps[first:last] == 0.0) > STAIRS:
        return None
    resolution = _resolution(values[:MOST])
    if np.mean(bends < ROUNDED * resolution) < LEAST_STRAIGHT:
        return None  # no k can do, which spares looking at each
    for k in range(min(SLOWEST, bends.size // FEWEST), 1, -1):  # every divisor of the true one would do
        turns = bends[: bends.size // k * k].reshape(-1, k)
        turns = turns[turns.any(axis=1)]
        if len(turns) < FEWEST:
            continue
        bent = np.sum(turns > ROUNDED * resolution, axis=0)
        own = int(np.argmax(bent))
        most = float(np.median(turns[:, own]))
        if ODD * most > ROUNDED * resolution and 2 * (bent.sum() - bent[own]) > len(turns) * (k - 1):
            continue  # more than half of the others bend: their median does
        others = np.minimum(np.delete(turns, own, axis=1), ODD * most)
        straight = float(np.median(others)) < ROUNDED * resolution
        if straight and most > SHARPER * float(others.mean(axis=0).max()):
            return np.arange((own + 1) % k, values.size, k, dtype=np.intp)
    return None


def _resolution(values: Array) -> float:
    """The smallest step between neighbors, at least what six digits leave."""
    known = values[np.isfinite(values)]
    steps, least = np.abs(np.diff(known)), WRITTEN * float(np.abs(known).max(initial=0.0))
    return float(max(steps[steps > 1e-6 * least].min(initial=np.inf), least)) if np.any(steps > 1e-6 * least) else least
