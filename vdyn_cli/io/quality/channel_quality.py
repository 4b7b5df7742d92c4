"""Faults of one channel: missing, held and clipped values, distinguished from rest, plateaus and quantization."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.clocks.held_values import held_rows
from vdyn_cli.io.clocks.interpolated_values import sampled_rows
from vdyn_cli.quantities.arrays import Array, Mask, Rows, spans
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.vocabulary import VARYING

Window = tuple[float, float]
WHOLE = (-np.inf, np.inf)  # s, the window of a log that is used from its beginning to its end
_MISSING = 0.5  # share of rows without a value, above which a channel is unusable
_LEVELS = 16  # distinct values; a channel with no more is a switch or a gear, which may be constant for any time
_SAMPLE = 20_000  # values that suffice to estimate a channel's resolution
_CHUNK = 1 << 20
_CLIPPED = 4  # equal values in a row, at least
_RESTS = 20  # samples, least length of a normal constant segment that is assumed
_STUCK = 50  # samples, fewest from which a constant channel counts as failed
_STANDING = 0.02  # of the largest speed, below which the car stands
_APART = 5.0  # times the longest other segment, length of a single segment that may be frozen


@dataclass(frozen=True)
class Quality:
    """Findings on a channel, and problems that make it unusable."""

    findings: tuple[Finding, ...] = ()
    problems: tuple[Finding, ...] = ()


@dataclass(frozen=True)
class _Rows:
    """The number in the file of each checked sample, and the word for it: line, row, sample."""

    number: Callable[[int], int]
    called: str

    def span(self, start: int, length: int) -> str:
        """Text of the place of a segment in the file."""
        first, last = self.number(start), self.number(start + length - 1)
        return f"{self.called} {first}" if first == last else f"{self.called}s {first} to {last}"


@dataclass(frozen=True)
class _Runs:
    """Segments of equal values: first index and length of each."""

    start: NDArray[np.int32]
    length: NDArray[np.int32]


def check_channel(log: Log, channel: str, unit: str, window: Window = WHOLE) -> Quality:
    """Check one channel of a log as read.

    Parameters
    ----------
    log : channels in the file's units, NaN where no value was recorded.
    unit : the file's, for messages.
    window : s, first and last time that is used, in which most values must be present.

    Notes
    -----
    *Constant*: a channel of a moving vehicle (``VARYING``) has a single value, other than zero.

    *Clipped*: the largest or smallest value lasts several samples, more than once, and the signal reaches and leaves it
    too steeply for a natural peak. A parabola that spends L samples in its top quantum q enters it at a slope s with
    s L / 4 <= q, so an overshoot s L / 4 of many quanta means that the top was cut off. Zero and 100 % are normal rest
    values, and so is any value of a brake that holds the standing car. A slow or well-controlled channel is constant at
    other values, too, so that its extremes prove nothing.

    *Held*: it changes at every k-th row only, by more than its resolution, like a slower sensor on a faster clock: see
    ``held_rows``.

    *Interpolated*: its slope changes at every k-th row only: see ``sampled_rows``.
    """
    values, where, every = log[channel], log.place(channel), _Rows(log.line, log.row)
    missing = np.isnan(values)
    rows: Rows | None = None
    findings: list[Finding] = []
    if missing.any():
        rows = np.flatnonzero(~missing)
        found = _missing(missing, rows, where, every)
        used = missing[slice(*np.searchsorted(log.time, window))]
        if not rows.size or np.mean(used if used.size else missing) > _MISSING:
            return Quality(problems=(replace(found, remedy=_other_column(log.time, missing)),))
        findings.append(found)
        values = values[rows]

    line = _Rows(lambda index: log.line(int(index if rows is None else rows[index])), log.row)
    if values.size >= _STUCK and values[0] != 0.0 and channel in VARYING and np.all(values == values[0]):
        what = "is constant in the whole log: sensor failed or not connected"
        remedy = "remove the channel, or repair the sensor and repeat the test"
        return Quality(
            (*findings, Finding(where, what, f"{values[0]:g} {unit}".strip(), remedy, fault=True, doubt=True))
        )
    sample = values[:: -(-values.size // _SAMPLE)]
    if np.unique(sample).size <= _LEVELS:
        return Quality(tuple(findings))
    findings += _held(values, where) or _interpolated(values, where)
    values = _released_at_rest(log, channel, values, rows)
    runs = _equal_runs(values)
    for named_extreme in (("largest", float(values.max())), ("smallest", float(values.min()))):
        findings += _clipped(values, runs, named_extreme, unit, where, line)
    return Quality(tuple(findings))


def _released_at_rest(log: Log, channel: str, values: Array, rows: Rows | None) -> Array:
    """The values of a brake, zero where the car stands, which any torque holds; other channels as they are."""
    if channel != "brake_torque" or "speed" not in log:
        return values
    speed = np.abs(log["speed"] if rows is None else log["speed"][rows])
    return np.where(speed < _STANDING * np.nanmax(speed, initial=0.0), 0.0, values)


def _missing(missing: Mask, rows: Rows, where: str, every: _Rows) -> Finding:
    n = missing.size
    if rows.size == 0:
        return Finding(where, "is empty")
    runs = spans(missing)
    first, stop = max(runs, key=lambda r: r[1] - r[0])
    percent = 100 * (n - rows.size) / n
    share = f"{percent:.0f}" if percent >= 10 else f"{percent:.2g}"
    what = (
        f"has no value in {n - rows.size} of {n} rows ({share} %), {_times(len(runs))},"
        f" longest: {every.span(first, stop - first)}"
    )
    return Finding(where, what)


def _other_column(time: Array, missing: Mask) -> str:
    """The remedy for a channel that is mostly missing: the part of the log between its first and last value if that is
    mostly complete, else another column."""
    rows = np.flatnonzero(~missing)
    if rows.size < 2 or np.mean(missing[rows[0] : rows[-1] + 1]) > _MISSING:
        return "map another column, or leave out this run or this channel"
    first = f"from_time: {np.ceil(1e3 * time[rows[0]]) / 1e3:.15g} s" if rows[0] else ""
    last = f"to_time: {np.floor(1e3 * time[rows[-1]]) / 1e3:.15g} s" if rows[-1] < missing.size - 1 else ""
    return f"map another column, or add '{', '.join(filter(None, (first, last)))}' to the run"


def _equal_runs(values: Array) -> _Runs:
    # In chunks and short integers: a noisy channel has as many segments as samples.
    parts = [np.zeros(1, np.int32)]
    for first in range(1, values.size, _CHUNK):
        last = min(first + _CHUNK, values.size)
        parts.append((np.flatnonzero(values[first:last] != values[first - 1 : last - 1]) + first).astype(np.int32))
    start = np.concatenate(parts)
    return _Runs(start, np.diff(start, append=np.int32(values.size)))


def _held(values: Array, where: str) -> list[Finding]:
    """The finding that each value is held for several rows; empty if it is not."""
    own = held_rows(values)
    if own is None:
        return []
    what = f"changes only once in {np.median(np.diff(own)):.0f} rows: a slower sensor whose value is held"
    return [Finding(where, what, remedy="no action needed: it is interpolated linearly between its changes")]


def _interpolated(values: Array, where: str) -> list[Finding]:
    own = sampled_rows(values)
    if own is None:
        return []
    what = (
        f"changes its slope only once in {own[1] - own[0]} rows: a slower sensor whose values were interpolated "
        "linearly"
    )
    return [Finding(where, what, remedy="map the channel as measured, without interpolated rows")]


def _clipped(
    values: Array, runs: _Runs, named_extreme: tuple[str, float], unit: str, where: str, line: _Rows
) -> list[Finding]:
    word, extreme = named_extreme
    if extreme == 0.0 or (extreme == 100.0 and unit in ("%", "percent")) or (extreme == 1.0 and unit in ("", "1")):
        return []
    cut = _cut_off(values, extreme, runs)
    if cut.size == 0:
        return []
    length = runs.length[cut]
    worst = cut[np.argmax(length)]
    others = np.delete(runs.length, worst)
    alone = cut.size == 1 and length[0] >= _APART * max(int(others.max(initial=0)), _RESTS)
    why = "frozen, or clipped" if alone else "clipped"
    what = (
        f"is at its {word} value, {extreme:.6g} {unit}, {_times(cut.size)}, {int(length.sum())} samples in all,"
        f" the longest in {line.span(int(runs.start[worst]), int(runs.length[worst]))}: {why}"
    )
    remedy = "the true values exceed it: check the sensor's range, or remove these runs"
    return [Finding(where, what, remedy=remedy)]


def _cut_off(values: Array, extreme: float, runs: _Runs) -> Rows:
    """Indices of the segments at an extreme value that are clipped peaks."""
    none = np.empty(0, dtype=np.intp)
    at = np.flatnonzero(runs.length >= _CLIPPED)
    at = at[values[runs.start[at]] == extreme]
    if at.size == 0:
        return none
    value = values[runs.start]
    at = at[runs.length[at] >= 3.0 * _usual_hold(values, value, runs)]
    overshoot, quantum = _overshoot(values, extreme, runs.start[at].astype(np.intp), runs.length[at])
    cut = at[overshoot > 5.0 * quantum]
    # A single segment must be so short that the missing overshoot does not exceed twice the measured range.
    once = (overshoot > 20.0 * quantum) & (overshoot < 2.0 * (values.max() - values.min()))
    return none if cut.size < 2 and not once.any() else cut


def saturated_spans(values: Array) -> list[tuple[int, int]]:
    """First sample, and the one after the last, of each peak clipped at the largest or smallest value.

    Parameters
    ----------
    values : (n,), SI, without gaps. Zero and one (100 %) are normal rest values.
    """
    if np.unique(values[:: -(-values.size // _SAMPLE)]).size <= _LEVELS:
        return []
    runs = _equal_runs(values)
    extremes = [x for x in (float(values.max()), float(values.min())) if x not in (0.0, 1.0)]
    cut = [int(i) for extreme in extremes for i in _cut_off(values, extreme, runs)]
    return sorted((int(runs.start[i]), int(runs.start[i] + runs.length[i])) for i in cut)


def _usual_hold(values: Array, value: Array, runs: _Runs) -> float:
    """The length of constant segments that 95 % of the samples that are neither extreme nor zero do not exceed."""
    inner = runs.length[(value != 0.0) & (value != values.max()) & (value != values.min())]
    count = np.bincount(inner) * np.arange(inner.max(initial=0) + 1)
    return float(np.searchsorted(np.cumsum(count), 0.95 * count.sum()))


def _overshoot(values: Array, extreme: float, start: Rows, length: NDArray[np.int32]) -> tuple[Array, float]:
    """The overshoot of a peak with each segment's length and flanks, and the channel's resolution."""
    stop = start + length
    quantum = _quantum(values)
    before, after = np.minimum(start, 5), np.minimum(values.size - stop, 5)
    inside = (before > 0) & (after > 0)
    rise = np.abs(extreme - values[start - before]) - quantum
    fall = np.abs(extreme - values[np.minimum(stop + after, values.size) - 1]) - quantum
    flank = np.minimum(rise / np.maximum(before, 1), fall / np.maximum(after, 1))
    return np.where(inside, flank * length / 4.0, 0.0), quantum


def _quantum(values: Array) -> float:
    """The smallest step between neighbors: the resolution of a quantized channel."""
    steps = np.abs(np.diff(values[:_SAMPLE]))
    steps = steps[steps > 1e-12 * np.abs(values[:_SAMPLE]).max()]
    return float(steps.min()) if steps.size else 0.0


def _times(n: int) -> str:
    return "once" if n == 1 else f"{n} times"
