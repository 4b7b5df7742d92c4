"""Reduce a log to the rate that a step's model needs, by means over blocks of equal duration."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array, Rows
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log

LEAST_SAMPLES = 2  # per block on average; a log with fewer is not averaged
LEAST_FINITE = 0.5  # share of a block's samples that must be finite


def condensed(log: Log, rate: float) -> Log:
    """The log averaged over blocks of 1 / rate; the log itself if a block has fewer than two samples on average.

    Mean of every channel and of the time over the samples of each block: for white noise the block means keep all the
    information about a signal that is linear within a block; the mean of a curved one is off by x'' / (24 rate^2).
    Blocks without samples, as in a gap, have no row; a block with fewer than half of a channel's samples is NaN.

    Parameters
    ----------
    rate : blocks per second, Hz.
    """
    if log.time.size < 2 or log.time.size < LEAST_SAMPLES * rate * log.duration:
        return log
    block = np.floor((log.time - log.time[0]) * rate).astype(np.int64)
    starts = np.flatnonzero(np.r_[True, np.diff(block) > 0])
    counts = np.diff(np.r_[starts, log.time.size])
    # About the first sample of the block, so that a large time keeps its digits.
    first = log.time[starts]
    time = first + np.add.reduceat(log.time - np.repeat(first, counts), starts) / counts
    channels = {name: _means(values, starts, counts) for name, values in log.channels.items()}
    return Log(log.name, time, channels, log.findings)


def _means(values: Array, starts: Rows, counts: NDArray[np.int64]) -> Array:
    """Mean of the finite values of every block, (blocks,)."""
    finite = np.isfinite(values)
    if finite.all():
        return np.add.reduceat(values, starts) / counts
    held = np.add.reduceat(finite.astype(np.int64), starts)
    sums = np.add.reduceat(np.where(finite, values, 0.0), starts)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(held >= LEAST_FINITE * counts, sums / held, np.nan)


def condensing_note(before: tuple[Log, ...], after: tuple[Log, ...], rate: float) -> tuple[Finding, ...]:
    """A note with the number of rows before and after averaging at ``rate``, Hz; empty if no log was averaged."""
    made = [(b.time.size, a.time.size) for b, a in zip(before, after, strict=True) if a is not b]
    if not made:
        return ()
    rows, left = (sum(part) for part in zip(*made, strict=True))
    what = f"{len(made)} logs are averaged over blocks of {1e3 / rate:g} ms: {rows} rows become {left}"
    why = "no action needed: the simulation of this step has no faster dynamics"
    return (Finding("runs", what, remedy=why, minor=True),)
