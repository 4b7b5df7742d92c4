"""Where a sequence changes its level or its ratio to another one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Array


@dataclass(frozen=True)
class LevelChange:
    """The likeliest change of level in a sequence.

    Parameters
    ----------
    first : index of the first value after it. ratio : of the mean after it to that before.
    chance : probability of a change as clear in values of one level.
    over_line : squares about the two levels, over those about a straight line: below 1 if a drift explains less.
    """

    first: int
    ratio: float
    chance: float
    over_line: float


def level_change(values: Sequence[float], fewest: int) -> LevelChange | None:
    """The likeliest change with at least ``fewest`` values on either side; None without a value to choose.

    With n values before and m after it, of means y and y' and a pooled scatter s,

        t = (y' - y) / (s sqrt(1/n + 1/m))

    has Student's distribution with n + m - 2 degrees of freedom, if all are drawn alike from a normal distribution;
    ``chance`` is that of the largest t of all changes by Bonferroni's bound. Missing values (NaN) are left out. None
    also where all values are equal.
    """
    from scipy.special import stdtr

    number = np.flatnonzero(~np.isnan(values))
    y = np.asarray(values, dtype=float)[number]
    if y.size <= 2 * fewest or np.ptp(y) == 0.0:
        return None
    firsts = range(fewest, y.size - fewest + 1)
    left = [k * float(np.var(y[:k])) + (y.size - k) * float(np.var(y[k:])) for k in firsts]
    least, k = min(left), firsts[int(np.argmin(left))]
    before, after = float(np.mean(y[:k])), float(np.mean(y[k:]))
    t = abs(after - before) / np.sqrt(max(least, 1e-300) / (y.size - 2) * (1.0 / k + 1.0 / (y.size - k)))
    drift = y.size * float(np.var(y - np.polyval(np.polyfit(number, y, 1), number)))
    chance = len(left) * 2.0 * float(stdtr(y.size - 2, -t))
    return LevelChange(int(number[k]), after / before, chance, least / max(drift, 1e-300))


def ratio_pieces(y: Array, x: Array, penalty: float, shortest: int) -> list[int]:
    """First samples of the pieces that minimize sum (y - a_j x)^2 + penalty (number of pieces), exactly.

    Parameters
    ----------
    y, x : (n,), proportional to each other within a piece. shortest : samples of a piece.

    Notes
    -----
    Optimal partitioning: Jackson et al., IEEE Signal Processing Letters 12 (2005) 105.
    """
    n = y.size
    xx, xy, yy = (np.r_[0.0, np.cumsum(v)] for v in (x * x, x * y, y * y))
    cost, came = np.full(n + 1, np.inf), np.zeros(n + 1, dtype=int)
    cost[0] = 0.0
    for end in range(shortest, n + 1):
        first = slice(0, end - shortest + 1)
        part = xx[end] - xx[first]
        squares = yy[end] - yy[first] - (xy[end] - xy[first]) ** 2 / np.maximum(part, 1e-300)
        total = cost[first] + squares + penalty
        came[end] = int(np.argmin(total))
        cost[end] = total[came[end]]
    starts, end = list[int](), n
    while end > 0:
        end = int(came[end])
        starts.append(end)
    return starts[::-1]
