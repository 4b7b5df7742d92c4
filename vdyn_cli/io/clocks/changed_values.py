"""Channels that a logger writes only where their value changes: blanks after a value mean that it still holds."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vdyn_cli.quantities.arrays import Array, Mask, Rows
from vdyn_cli.quantities.log import Log

# Steps by one quantum up, and as many down, that show this way of logging if hardly any value repeats the one before: a
# channel that is sampled regularly has equal neighbors about as often as neighbors that differ by one quantum in one
# direction.
_FEWEST_STEPS = 10
_MOST_EQUAL = 0.05  # equal neighbors per such step, at most, such as 0.00 after -0.00
_ONE_QUANTUM = 1.5  # quanta, below which a step is one
_LATEST = 0.5  # periods before the next change, within which no held value is inserted
_EARLY = 0.1  # periods by which a held value may be early: messages are this regular
_NEIGHBOR = 1.5  # periods, up to which two values are neighbors: no value between them is missing
# Quantile of the steps between changes that is the period of a message, and the steps from which it shows; the period
# of a channel with fewer is the shortest of the others.
_PERIOD = 0.05
_FEWEST_CHANGES = 20


def rows_until_change(log: Log) -> Mapping[str, Rows]:
    """The rows (m,) of each channel that is written only where it changes, about one in each period of its messages.

    Blanks between hold the last value written (``held``). Empty unless a channel of the table shows this way of
    logging; then it holds for all channels with blanks of which hardly any value repeats the one before. But a channel
    of many neighboring values that does not show it may also be sampled regularly: in a gap at whose end it has changed
    by more than between any neighbors, and after its last value, its values are missing.
    """
    written = {name: np.flatnonzero(np.isfinite(values)) for name, values in log.channels.items()}
    steps = {name: np.diff(log[name][rows]) for name, rows in written.items() if 1 < rows.size < log.time.size}
    changing = [name for name, own in steps.items() if np.mean(own == 0.0) <= _MOST_EQUAL]
    shown = {name for name in changing if _shows_changes(steps[name])}
    if not shown:
        return {}
    apart = {name: np.diff(log.time[written[name]]) for name in changing}
    known = {name: float(np.quantile(t, _PERIOD)) for name, t in apart.items() if t.size >= _FEWEST_CHANGES}
    found = {}
    for name in changing:
        period = known.get(name, min(known.values()))
        near, moved = apart[name] <= _NEIGHBOR * period, np.abs(steps[name])
        sampled = name not in shown and np.count_nonzero(near) >= _FEWEST_CHANGES
        holds = np.append(moved <= moved[near].max(), False) if sampled else np.full(written[name].size, True)
        found[name] = _rows(log.time, written[name], holds, period)
    return found


def held(values: Array, rows: Rows) -> Array:
    """The values (m,) of a channel (n,) at some rows; where it is blank, the last one written before."""
    last = np.maximum.accumulate(np.where(np.isfinite(values), np.arange(values.size), 0))
    return values[last[rows]]


def _shows_changes(steps: Array) -> bool:
    """Whether a channel with these steps (n,) between written values is written at changes only."""
    moves = np.abs(steps[steps != 0.0])
    one = np.abs(steps) < _ONE_QUANTUM * moves.min(initial=np.inf)
    fewest = min(np.count_nonzero(one & (steps > 0.0)), np.count_nonzero(one & (steps < 0.0)))
    return bool(fewest >= _FEWEST_STEPS and np.count_nonzero(steps == 0.0) <= _MOST_EQUAL * fewest)


def _rows(time: Array, written: Rows, holds: Mask, period: float) -> Rows:
    """The written rows (m,) and, while a value ``holds`` (m,), one row in each period, s, as far as the table has any,
    and its last one."""
    after = np.arange(written[0], time.size)
    which = np.searchsorted(written, after, side="right") - 1
    ends = np.append(time[written[1:]] - _LATEST * period, np.inf)
    nth = np.floor((time[after] - time[written[which]]) / period + _EARLY)
    first = np.diff(nth, prepend=0.0) > 0.0
    first[-1] = True
    inserted = after[first & (nth >= 1.0) & (time[after] <= ends[which]) & holds[which]]
    return np.union1d(written, inserted)
