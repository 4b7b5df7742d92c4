"""Averages of neighboring samples: the cost of a fit then depends on the gusts' time scale, not on the log's rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array


@dataclass(frozen=True)
class Bins:
    """Consecutive groups of samples.

    Parameters
    ----------
    first : (b,), index of each group's first sample; ``count`` : (b,), its number of samples.
    time : (b,) s, mean time of each; ``width`` : (b,) s, time span of each.
    lead : (b,) s, mean time minus start of the span: half the width for many samples, zero for one.
    """

    first: NDArray[np.int64]
    count: NDArray[np.int64]
    time: Array
    width: Array
    lead: Array

    @property
    def sparse(self) -> bool:
        """Whether the samples are so far apart that none are averaged, as in a table of split times."""
        return bool(np.all(self.count == 1))

    @property
    def lags(self) -> Array:
        """Time between each two groups, (b, b), s: |t_i - t_j| of their mean times."""
        return np.asarray(np.abs(self.time[:, None] - self.time[None, :]))

    def mean(self, values: Array) -> Array:
        """Mean of each group, of (n,) values or (n, k) columns."""
        sums = np.add.reduceat(values, self.first, axis=0)
        return np.asarray(sums / (self.count if values.ndim == 1 else self.count[:, None]))


def cut(time: Array, width: float, part: NDArray[np.int64] | None = None) -> Bins:
    """Group samples into equal spans of time.

    Parameters
    ----------
    time : (n,) s, increasing, n >= 2.
    width : s, largest width; a log that is sampled more slowly keeps its samples.
    part : (n,), labels of segments that no group may span, such as the windows of one log.
    """
    part = np.zeros(time.size, dtype=np.int64) if part is None else part
    begins = np.flatnonzero(np.r_[True, part[1:] != part[:-1]])
    ends = np.r_[begins[1:], time.size] - 1
    label = np.empty(time.size, dtype=np.int64)
    offset = 0
    for a, b in zip(begins, ends, strict=True):
        span = float(time[b] - time[a])
        groups = max(1, int(np.ceil(span / width - 1e-9)))
        inside = (time[a : b + 1] - time[a]) * (groups / span) if span > 0 else np.zeros(1)
        label[a : b + 1] = offset + np.minimum(inside.astype(np.int64), groups - 1)
        offset += groups
    first = np.flatnonzero(np.r_[True, label[1:] != label[:-1]]).astype(np.int64)
    count = np.diff(np.r_[first, time.size]).astype(np.int64)
    # A group extends to the first sample of the next one, and the last group of a segment to the segment's end.
    until = np.r_[time[first[1:]], time[-1]]
    until[np.searchsorted(first, ends, side="right") - 1] = time[ends]
    middle = np.add.reduceat(time, first) / count
    return Bins(first, count, middle, until - time[first], middle - time[first])


@dataclass(frozen=True)
class Nodes:
    """Instants whose values suffice to compute the mean of a smooth trace over the samples of every bin.

    Parameters
    ----------
    time : (2 b + 1,) s, edges and middles of the bins, increasing.
    weights : (b, 3), of a bin's first edge, middle and last edge.
    """

    time: Array
    weights: Array

    def mean(self, values: Array) -> Array:
        """Mean over the samples of each bin, from (2 b + 1,) values or (2 b + 1, k) columns at the nodes."""
        first, middle, last = self.weights.T if values.ndim == 1 else self.weights.T[:, :, None]
        return np.asarray(first * values[:-1:2] + middle * values[1::2] + last * values[2::2])


def nodes(time: Array, bins: Bins) -> Nodes:
    """Nodes of the bins of one segment; exact for traces that are parabolas within a bin.

    The weights are the means of Lagrange's polynomials over the bin's samples, so uneven sampling does no harm.

    Parameters
    ----------
    time : (n,) s, of the samples. bins : their groups, (b).
    """
    first = bins.first
    edges = np.r_[time[0], 0.5 * (time[first[1:]] + time[first[1:] - 1]), time[-1]]
    at = np.empty(2 * edges.size - 1)
    at[::2], at[1::2] = edges, 0.5 * (edges[1:] + edges[:-1])
    half = np.repeat(0.5 * np.diff(edges), bins.count)
    x = (time - np.repeat(at[1::2], bins.count)) / half
    weights = [bins.mean(w) for w in (0.5 * x * (x - 1.0), 1.0 - x * x, 0.5 * x * (x + 1.0))]
    return Nodes(at, np.column_stack(weights))
