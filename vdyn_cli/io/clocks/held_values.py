"""A slower sensor whose value is held (zero-order hold) on a faster clock: its samples, and interpolation between them.

A value held for k rows is (k - 1)/2 rows late on average, which looks like a delay of the sensor, and k rows contain
only one reading. Linear interpolation between the samples removes the delay, except that a sensor on its own clock
samples between two rows: its values are then up to one row late, half a row on average.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vdyn_cli.quantities.arrays import Array, Rows
from vdyn_cli.quantities.log import Log

LEAST_HELD = 1.5  # rows per value on average: below, more than half of the values last one row
FEWEST_CHANGES = 30  # changes, at least
REGULAR = 0.8  # share of the changes that must come after the median number of rows
JITTERING = 3  # rows per value, from which a change may come one row earlier or later: of 2 rows, any pattern would do
REPEATING = 5  # rows per value, from which the same holds after equal readings: of 3 rows, any pattern would do
LEVELS = 16  # distinct values; a channel with no more is a switch or a gear
COARSE = 1.5  # quanta, least median step: a constant slope of a coarse channel changes as regularly, always by one
SAMPLE = 20_000  # values that suffice to estimate the resolution


def held_rows(values: Array) -> Rows | None:
    """The rows (m,) at which a held channel (n,) without gaps was sampled; None if it is not held.

    A constant segment of m k rows contains m equal readings, as of a car at rest.
    """
    first = np.r_[0, np.flatnonzero(values[1:] != values[:-1]) + 1]
    length = np.diff(first, append=values.size)
    if length.size < FEWEST_CHANGES or length.size * LEAST_HELD > values.size:
        return None
    usual = int(np.median(length))
    equal = np.maximum(np.rint(length / usual), 1)  # readings in each segment
    near = np.abs(length - equal * usual) <= np.where(equal > 1, usual >= REPEATING, usual >= JITTERING)
    steps = np.abs(np.diff(values[first]))
    finest = steps[:SAMPLE][steps[:SAMPLE] > 1e-12 * np.abs(values).max()].min(initial=np.inf)
    if usual < 2 or near.mean() < REGULAR or np.median(steps) < COARSE * finest:
        return None
    if np.unique(values[:: -(-values.size // SAMPLE)]).size <= LEVELS:
        return None
    starts, stops = first[1:-1], first[2:]  # the log begins and ends within a held value
    counts = np.maximum(np.rint((stops - starts) / usual), 1).astype(np.intp)
    nth = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    inner = np.repeat(starts, counts) + nth * np.repeat((stops - starts) / counts, counts)
    before, after = np.arange(first[1] - usual, -1, -usual)[::-1], np.arange(first[-1], values.size, usual)
    return np.concatenate([before, np.rint(inner), after]).astype(np.intp)


def with_held_interpolated(log: Log) -> Log:
    """The log with held channels interpolated linearly between their samples, which ``log.samples`` keeps.

    ``log.held`` names them, with the row of the log.
    Before its first and after its last sample a channel is unchanged; gaps stay gaps.
    """
    samples, changed, held = dict(log.samples), dict[str, Array](), dict(log.held)
    for name, values in log.channels.items():
        there = np.flatnonzero(np.isfinite(values))
        own = held_rows(values[there]) if name not in samples else None
        if own is not None:
            rows = there[own]
            samples[name] = log.time[rows], values[rows]
            held[name] = float(np.median(np.diff(log.time)))
            inside = there[own[0] : own[-1] + 1]
            changed[name] = values.copy()
            changed[name][inside] = np.interp(log.time[inside], *samples[name])
    return replace(log, channels={**log.channels, **changed}, samples=samples, held=held) if changed else log
