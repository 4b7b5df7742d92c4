"""A slower sensor whose values were interpolated linearly on a faster clock: the rows at which it was sampled.

The rows between contain no information: what looks like a hundred quiet samples is one noisy sample.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vdyn_cli.quantities.arrays import Array, Rows
from vdyn_cli.quantities.log import Log

# A bend is the absolute second difference of a channel.
MOST_ROWS = 50_000  # rows evaluated
COARSE_SHARE = 0.8  # share of zero steps above which a channel is coarse, and bends wherever it rises
FEWEST_SAMPLES = 30  # samples, at least
LARGEST_SPACING = 200  # rows from one sample to the next, at most
LEAST_BEND_RATIO = 2.5  # least ratio of the median bend at samples to the mean bend of any other rows
ROUNDING_BEND = 1.5  # quanta, bend of a straight line that rounding usually causes
LEAST_QUANTUM = 1e-5  # of the largest value, least quantum: six digits, or single precision
LEAST_STRAIGHT_SHARE = 0.2  # share of the bends within rounding; an interpolated channel has at least a quarter
GLITCH_LIMIT = 20.0  # times the median bend at samples, to which larger bends (glitches) are limited


def sampled_rows(values: Array) -> Rows | None:
    """The rows (m,) at which an interpolated channel (n,) was sampled; None if it is not interpolated.

    Its second difference is zero, except for rounding, at all rows but every k-th, k >= 2.
    """
    steps = np.diff(values[:MOST_ROWS])
    bends = np.abs(np.diff(steps))
    bends = np.where(np.isfinite(bends), bends, 0.0)
    moves = np.flatnonzero(bends)
    if moves.size < FEWEST_SAMPLES:
        return None
    first, last = int(moves[0]), int(moves[-1]) + 1
    if np.mean(steps[first:last] == 0.0) > COARSE_SHARE:
        return None
    resolution = _resolution(values[:MOST_ROWS])
    if np.mean(bends < ROUNDING_BEND * resolution) < LEAST_STRAIGHT_SHARE:
        return None  # no k is possible
    for k in range(
        min(LARGEST_SPACING, bends.size // FEWEST_SAMPLES), 1, -1
    ):  # largest first: divisors of the true k fit, too
        turns = bends[: bends.size // k * k].reshape(-1, k)
        turns = turns[turns.any(axis=1)]
        if len(turns) < FEWEST_SAMPLES:
            continue
        bent = np.sum(turns > ROUNDING_BEND * resolution, axis=0)
        own = int(np.argmax(bent))
        most = float(np.median(turns[:, own]))
        if GLITCH_LIMIT * most > ROUNDING_BEND * resolution and 2 * (bent.sum() - bent[own]) > len(turns) * (k - 1):
            continue  # more than half of the other rows bend, so that their median does
        others = np.minimum(np.delete(turns, own, axis=1), GLITCH_LIMIT * most)
        straight = float(np.median(others)) < ROUNDING_BEND * resolution
        if straight and most > LEAST_BEND_RATIO * float(others.mean(axis=0).max()):
            return np.arange((own + 1) % k, values.size, k, dtype=np.intp)
    return None


def with_own_samples(log: Log, channel: str) -> Log:
    """The log whose ``samples`` contain those of a channel, where it was interpolated linearly; else unchanged."""
    own = None if channel in log.samples or channel not in log else sampled_rows(log[channel])
    if own is None:
        return log
    return replace(log, samples={**log.samples, channel: (log.time[own], log[channel][own])})


def _resolution(values: Array) -> float:
    """The smallest step between neighbors, but no less than the rounding to six digits."""
    known = values[np.isfinite(values)]
    steps, least = np.abs(np.diff(known)), LEAST_QUANTUM * float(np.abs(known).max(initial=0.0))
    return float(max(steps[steps > 1e-6 * least].min(initial=np.inf), least)) if np.any(steps > 1e-6 * least) else least
