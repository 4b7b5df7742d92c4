"""Spikes of single samples, dropouts, and permanent steps of a channel."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.arrays import Array, Rows

_BLOCK = 16  # samples over which the local level of deviations is estimated
_LEVEL = 5  # samples on either side of a step
_FEWEST_SAMPLES = 50  # samples, fewest that determine a tail


def spikes(values: Array, resolution: float) -> Rows:
    """The indices of single samples that deviate from both neighbors far more than the channel's other samples.

    s_i = min(|x_i - x_(i-1)|, |x_i - x_(i+1)|) if x_i is above or below both, else 0, divided by the local median of
    |second difference| / 3. The threshold extrapolates the tail of the other samples exponentially, which bounds the
    tail of usual noise, so that one of the n samples of a healthy channel exceeds it with the probability
    ``false_alarm``; and the smallest spike must exceed the largest other deviation by ``spike_apart``. A sample on the
    line through the two before it, or the two behind it, is a corner of the signal: an acceleration that ends.

    Parameters
    ----------
    values : (n,), without gaps. resolution : quantum of the channel.
    """
    n = values.size
    if n < _FEWEST_SAMPLES:
        return np.empty(0, dtype=np.intp)
    up, down = values[1:-1] - values[:-2], values[1:-1] - values[2:]
    alone = np.where(up * down > 0.0, np.minimum(np.abs(up), np.abs(down)), 0.0)
    bends = np.abs(up + down) / 3.0
    local = _local_level(bends)
    least = max(QUALITY.quiet_level * float(np.median(local)), resolution, 1e-300)
    ratio = alone / np.maximum(local, least)
    tail = max(int(QUALITY.spike_tail * n), 10)
    most = max(int(QUALITY.most_spikes * n), 3)
    order = np.argsort(ratio)[::-1][: tail + most + 1]
    if order.size <= tail + most:
        return np.empty(0, dtype=np.intp)
    back = np.abs(values[2:] - values[:-2])
    trend = np.zeros(n - 2)
    trend[1:-1] = 0.5 * (values[4:] - values[:-4])  # a constant slope also separates the neighbors
    back = np.minimum(back, 2.0 * np.abs(values[2:] - values[:-2] - trend))
    bent = np.full(n - 2, np.inf)  # distance from the nearer of the two lines
    bent[1:] = np.abs(values[2:-1] - 2.0 * values[1:-2] + values[:-3])
    bent[:-1] = np.minimum(bent[:-1], np.abs(values[1:-2] - 2.0 * values[2:-1] + values[3:]))
    back = np.where(bent < QUALITY.spike_corner * alone, np.inf, back)
    size = ratio[order]
    for k in range(most, 0, -1):  # the k largest are spikes if they are much larger than all others
        excess = float(np.mean(size[k : k + tail]) - size[k + tail])
        limit = max(size[k + tail] + excess * np.log(tail / QUALITY.false_alarm), QUALITY.spike_ratio)
        if size[k - 1] > limit and size[k - 1] > QUALITY.spike_apart * size[k]:
            found = order[:k]
            return np.asarray(np.sort(found[back[found] < QUALITY.spike_return * alone[found]]) + 1, dtype=np.intp)
    return np.empty(0, dtype=np.intp)


def _local_level(values: Array) -> Array:
    """The largest median of the three blocks around each sample."""
    count = -(-values.size // _BLOCK)
    padded = np.concatenate([values, values[-1:].repeat(count * _BLOCK - values.size)])
    middle = np.median(padded.reshape(count, _BLOCK), axis=1)
    wide = np.concatenate([middle[:1], middle, middle[-1:]])
    level = np.maximum(np.maximum(wide[:-2], wide[1:-1]), wide[2:])
    return np.repeat(level, _BLOCK)[: values.size]


def dropouts(values: Array) -> list[tuple[int, int]]:
    """Segments of one value that the channel jumps to, and back from, by more than ``dropout_jump`` usual steps.

    Returned as first sample and the one after the last; the usual step is the 99 % quantile of the nonzero ones.

    Parameters
    ----------
    values : (n,), without gaps.
    """
    if values.size < _FEWEST_SAMPLES:
        return []
    steps = np.diff(values)
    moves = np.flatnonzero(steps)
    if moves.size < _FEWEST_SAMPLES // 2:
        return []
    usual = float(np.quantile(np.abs(steps[moves]), 0.99))
    jumps = steps[moves]
    # The channel jumps to a value at one change and jumps back at the next.
    large = np.abs(jumps) > QUALITY.dropout_jump * usual
    pair = np.flatnonzero(large[:-1] & large[1:] & (jumps[:-1] * jumps[1:] < 0.0))
    return [(int(moves[k]) + 1, int(moves[k + 1]) + 1) for k in pair]


def pulses(values: Array) -> list[tuple[int, int]]:
    """Segments of 2 to ``longest_pulse`` samples that a speed jumps to, and back from, as dropouts but not constant.

    Returned as first sample and the one after the last; a jump exceeds the 99 % quantile of the nonzero steps
    ``dropout_jump`` times, and the values before and after differ by less than ``spike_return`` of it.

    Parameters
    ----------
    values : (n,) of a car's speed, without gaps: its mass lets it change by no such step.
    """
    steps = np.diff(values)
    size = np.abs(steps[steps != 0.0])
    if size.size < _FEWEST_SAMPLES:
        return []
    jumps = np.flatnonzero(np.abs(steps) > QUALITY.dropout_jump * float(np.quantile(size, 0.99)))
    found = []
    for a, b in pairwise(jumps.tolist()):
        back = abs(values[b + 1] - values[a]) < QUALITY.spike_return * min(abs(steps[a]), abs(steps[b]))
        if 2 <= b - a <= QUALITY.longest_pulse and back and steps[a] * steps[b] < 0.0:
            found.append((a + 1, b + 1))
    return found


def level_step(values: Array) -> int | None:
    """The first sample after the one permanent jump of a channel that otherwise changes smoothly; None if none.

    The largest step must exceed the second largest ``step_apart`` times and the 99 % quantile of the others
    ``dropout_jump`` times, and the medians of ``_LEVEL`` samples before and after must differ by half of it.

    Parameters
    ----------
    values : (n,) of a speed or load, without gaps.
    """
    if values.size < _FEWEST_SAMPLES:
        return None
    steps = np.diff(values)
    size = np.abs(steps)
    at = int(np.argmax(size))
    others = np.delete(size, at)
    usual = float(np.quantile(others[others > 0.0], 0.99)) if np.any(others) else 0.0
    apart = size[at] > max(QUALITY.step_apart * float(others.max(initial=0.0)), QUALITY.dropout_jump * usual)
    if not (apart and usual > 0.0):
        return None
    before, after = values[max(at - _LEVEL, 0) : at + 1], values[at + 1 : at + 1 + _LEVEL]
    lasts = min(before.size, after.size) >= _LEVEL and abs(np.median(after) - np.median(before)) > 0.5 * size[at]
    return at + 1 if lasts else None
