"""Single samples and dropouts that leave a channel's own signal and come back, and steps that stay."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.quality.quality_policy import QualityPolicy
from vdyn_cli.quantities.arrays import Array

Rows = NDArray[np.intp]

_BLOCK = 16  # samples over which the local level of deviations is taken
_LEVEL = 5  # samples on either side of a step
_SHORTEST = 50  # samples, below which no tail is known


def spikes(values: Array, resolution: float, policy: QualityPolicy) -> Rows:
    """The single samples that stand out of both neighbors by more than the channel's deviations ever do.

    s_i = min(|x_i - x_(i-1)|, |x_i - x_(i+1)|) where x_i is above or below both, else 0, over the median of |second
    difference| / 3 about it. The threshold extrapolates the tail of the other samples as an exponential one, which
    that of any usual noise is or falls below, so that one of the n samples of a healthy channel exceeds it with the
    probability ``false_alarm``; and the smallest spike must stand apart from the largest other deviation.

    Parameters
    ----------
    values : (n,), without gaps. resolution : quantum of the channel.
    """
    n = values.size
    if n < _SHORTEST:
        return np.empty(0, dtype=np.intp)
    up, down = values[1:-1] - values[:-2], values[1:-1] - values[2:]
    alone = np.where(up * down > 0.0, np.minimum(np.abs(up), np.abs(down)), 0.0)
    bends = np.abs(up + down) / 3.0
    local = _local_level(bends)
    least = max(policy.quiet_level * float(np.median(local)), resolution, 1e-300)
    ratio = alone / np.maximum(local, least)
    tail = max(int(policy.spike_tail * n), 10)
    most = max(int(policy.most_spikes * n), 3)
    order = np.argsort(ratio)[::-1][: tail + most + 1]
    if order.size <= tail + most:
        return np.empty(0, dtype=np.intp)
    back = np.abs(values[2:] - values[:-2])
    trend = np.zeros(n - 2)
    trend[1:-1] = 0.5 * (values[4:] - values[:-4])  # a steady slope moves the neighbors apart, too
    back = np.minimum(back, 2.0 * np.abs(values[2:] - values[:-2] - trend))
    size = ratio[order]
    for k in range(most, 0, -1):  # the k largest are spikes where they stand apart from all others
        excess = float(np.mean(size[k : k + tail]) - size[k + tail])
        limit = max(size[k + tail] + excess * np.log(tail / policy.false_alarm), policy.spike_ratio)
        if size[k - 1] > limit and size[k - 1] > policy.spike_apart * size[k]:
            found = order[:k]
            return np.asarray(np.sort(found[back[found] < policy.spike_return * alone[found]]) + 1, dtype=np.intp)
    return np.empty(0, dtype=np.intp)


def _local_level(values: Array) -> Array:
    """The largest median of the three blocks about each sample."""
    count = -(-values.size // _BLOCK)
    padded = np.concatenate([values, values[-1:].repeat(count * _BLOCK - values.size)])
    middle = np.median(padded.reshape(count, _BLOCK), axis=1)
    wide = np.concatenate([middle[:1], middle, middle[-1:]])
    level = np.maximum(np.maximum(wide[:-2], wide[1:-1]), wide[2:])
    return np.repeat(level, _BLOCK)[: values.size]


def dropouts(values: Array, policy: QualityPolicy) -> list[tuple[int, int]]:
    """Stretches of one value that the channel jumps to, and jumps back from, unlike it ever moves.

    Parameters
    ----------
    values : (n,), without gaps.
    """
    if values.size < _SHORTEST:
        return []
    steps = np.diff(values)
    moves = np.flatnonzero(steps)
    if moves.size < _SHORTEST // 2:
        return []
    usual = float(np.quantile(np.abs(steps[moves]), 0.99))
    jumps = steps[moves]
    # A value that is jumped to at one move and left by a jump back at the next.
    large = np.abs(jumps) > policy.dropout_jump * usual
    pair = np.flatnonzero(large[:-1] & large[1:] & (jumps[:-1] * jumps[1:] < 0.0))
    return [(int(moves[k]) + 1, int(moves[k + 1]) + 1) for k in pair]


def level_step(values: Array, policy: QualityPolicy) -> int | None:
    """The first sample after the one step by which a channel that moves evenly jumps for good; None where none does.

    Parameters
    ----------
    values : (n,) of a speed, without gaps.
    """
    if values.size < _SHORTEST:
        return None
    steps = np.diff(values)
    size = np.abs(steps)
    at = int(np.argmax(size))
    others = np.delete(size, at)
    usual = float(np.quantile(others[others > 0.0], 0.99)) if np.any(others) else 0.0
    apart = size[at] > max(policy.step_apart * float(others.max(initial=0.0)), policy.dropout_jump * usual)
    if not (apart and usual > 0.0):
        return None
    before, after = values[max(at - _LEVEL, 0) : at + 1], values[at + 1 : at + 1 + _LEVEL]
    lasts = min(before.size, after.size) >= _LEVEL and abs(np.median(after) - np.median(before)) > 0.5 * size[at]
    return at + 1 if lasts else None
