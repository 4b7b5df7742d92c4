"""Several loggers, one clock: the delay between two clocks from a channel that both recorded, and its uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.sampled import FINE, Signal, smoothed
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log

Array = NDArray[np.float64]

_WIDTHS = (2.0, 8.0, 32.0, 128.0, 512.0)  # smoothing, in steps of the slower logger
_BLOCKS = 16
_ITERATIONS = 30
_LEAST_OVERLAP = 0.5  # of the shorter log
_MOST_POINTS = 1 << 21  # of the coarse search
_LEAST_LIKENESS = 0.5  # concordance of the recordings, and correlation of their slopes


def align(reference: Log, other: Log, channel: str) -> tuple[float, float]:
    """Estimate how far another logger's clock is ahead, from a channel that both loggers recorded.

    Parameters
    ----------
    reference, other : logs that overlap by at least half of the shorter.
    channel : recorded by both; it may differ by a gain and an offset.

    Returns
    -------
    (delay, std) : s. What the reference stamps t, the other stamps t + delay; std is the standard error.

    Notes
    -----
    The whole-step delay has the largest concordance 2 cov(x, y) / (var x + var y + (mean x - mean y)^2) over all
    delays that leave enough overlap. It is refined by least squares of y(t + delay) on gain x(t) + offset, both
    smoothed by the same symmetric kernel, which moves neither in time, weighted by a slope that is smoothed until noise
    no longer spoils it. The standard error comes from 16 blocks of equal information, so that it holds for
    colored differences between the sensors; three of its degrees of freedom go to delay, gain and offset.
    Assumes clocks of equal rate; `merge` looks for drift.

    Raises
    ------
    InputError : the channel is missing, moves too little or too evenly, or matches at no delay or at several.
    """
    found = _align(reference, other, channel)
    return found.delay, found.std


@dataclass(frozen=True)
class _Alignment:
    delay: float
    std: float
    gain: float
    offset: float
    noise: float  # variance of the delay for white residuals of variance 1, less scattered than std is
    drift: float  # change of the delay from the start to the end
    drift_std: float


def _signal(log: Log, channel: str) -> Signal:
    if channel not in log or channel == "time":
        remedy = "map it for every logger, or name another channel with 'align_on'"
        raise InputError(Finding(log.name, f"has no channel '{channel}' to align the loggers on", remedy=remedy))
    written = np.isfinite(log[channel])
    values = log[channel][written]
    if values.size < 20 or np.ptp(values) == 0.0:
        what = f"channel '{channel}' is constant: it cannot align the loggers' clocks"
        raise InputError(Finding(log.name, what, remedy="name another channel with 'align_on'"))
    return Signal(log.time[written], values)


def _align(reference: Log, other: Log, channel: str) -> _Alignment:
    x, y = _signal(reference, channel), _signal(other, channel)
    where = f"{reference.name}, {other.name}: channel '{channel}'"
    coarse = _coarse_delay(x, y, where)
    span = float(np.ptp(x.time) + np.ptp(y.time))
    width = max(_WIDTHS[0] * max(x.step, y.step), FINE * span / _MOST_POINTS)
    grids = tuple(np.arange(s.time[0], s.time[-1], width / FINE) for s in (x, y))
    cells = tuple(s.averages(grid, width / FINE) for s, grid in zip((x, y), grids, strict=True))
    smooth = tuple(smoothed(c, 1.0) for c in cells)
    found: list[_Alignment] = []
    for times in _WIDTHS:
        slopes = tuple(np.gradient(smoothed(c, times / _WIDTHS[0]), width / FINE) for c in cells)
        fit = _refined(grids, smooth, slopes, coarse, 4.0 * times * width / _WIDTHS[0])
        found += [fit] if fit is not None else []
    if not found:
        what = "varies too little or too evenly to separate a delay from a gain and an offset"
        remedy = "log accelerating and braking too, or name another channel with 'align_on'"
        raise InputError(Finding(where, what, remedy=remedy))
    return min(found, key=lambda f: f.noise)


def _coarse_delay(x: Signal, y: Signal, where: str) -> float:
    """The delay of largest concordance on a common grid, to about one step of it.

    Raises
    ------
    InputError : no delay matches, only the opposite sign does, or two delays match equally well.
    """
    span = np.ptp(x.time) + np.ptp(y.time)
    step = max(x.step, y.step, span / _MOST_POINTS)
    a, b = (s.averages(np.arange(s.time[0], s.time[-1] + step / 2.0, step), step) for s in (x, y))
    concordance = _concordance(a, b)
    best = int(np.argmax(concordance))
    lags = (np.arange(concordance.size) - (a.size - 1)) * step
    if concordance[best] < _LEAST_LIKENESS:
        opposite = _concordance(a, -b).max() >= _LEAST_LIKENESS
        got = f"best concordance {concordance[best]:.2f}"
        remedy = "check the unit for both loggers, or name another channel with 'align_on'"
        remedy = "one logger has the opposite sign: add 'sign: -1' to its channel" if opposite else remedy
        raise InputError(Finding(where, "the two recordings do not match at any delay", got, remedy))
    miss = 1.0 - concordance
    far = np.flatnonzero(miss > 4.0 * miss[best])  # where the match is plainly lost, on either side of the best
    left, right = (int(far[far < best].max(initial=-1)), int(far[far > best].min(initial=miss.size)))
    rivals = [i for i in np.flatnonzero(miss < 1.2 * miss[best]) if i < left or i > right]
    if rivals:
        got = f"{lags[best] + y.time[0] - x.time[0]:.4g} s or {lags[rivals[0]] + y.time[0] - x.time[0]:.4g} s"
        remedy = "log a non-periodic manoeuvre, or name another channel with 'align_on'"
        raise InputError(Finding(where, "the two recordings match at several delays", got, remedy))
    return float(y.time[0] - x.time[0] + lags[best])


def _concordance(a: Array, b: Array) -> Array:
    """Concordance of a and b for each lag of b, -1 where too little of them overlaps."""
    center = float(np.nanmean(a))
    a, b = a - center, b - center
    count, sum_a, sum_b, sum_aa, sum_bb, sum_ab = _lagged_sums(a, b)
    enough = count >= _LEAST_OVERLAP * min(np.isfinite(a).sum(), np.isfinite(b).sum())
    n = np.where(enough, count, 1.0)
    var_a, var_b = sum_aa / n - (sum_a / n) ** 2, sum_bb / n - (sum_b / n) ** 2
    cov = sum_ab / n - sum_a * sum_b / n**2
    spread = np.maximum(var_a + var_b + ((sum_a - sum_b) / n) ** 2, 1e-9 * (np.nanvar(a) + np.nanvar(b)) + 1e-300)
    return np.asarray(np.where(enough, 2.0 * cov / spread, -1.0))


def _lagged_sums(a: Array, b: Array) -> tuple[Array, ...]:
    """For each lag of b from -(len a - 1) on: samples in common, sums of a, b, a^2, b^2 and a b over them."""
    size = 1 << int(a.size + b.size - 1).bit_length()
    parts = [(np.isfinite(v).astype(float), np.nan_to_num(v)) for v in (a, b)]
    (ones_a, za), (ones_b, zb) = parts

    def over_lags(left: Array, right: Array) -> Array:
        product = np.conj(np.fft.rfft(left, size)) * np.fft.rfft(right, size)
        circular = np.fft.irfft(product, size)
        return np.concatenate([circular[size - (a.size - 1) :], circular[: b.size]])

    count = np.rint(over_lags(ones_a, ones_b))
    pairs = ((za, ones_b), (ones_a, zb), (za * za, ones_b), (ones_a, zb * zb), (za, zb))
    return count, *(over_lags(left, right) for left, right in pairs)


def _refined(
    grids: tuple[Array, ...], smooth: tuple[Array, ...], slopes: tuple[Array, ...], delay: float, reach: float
) -> _Alignment | None:
    """Solve sum(slope (y(t + delay) - gain x(t) - offset)) = 0; None where that determines no delay nearby.

    The channels are smoothed just enough to be interpolated, so that neighboring blocks stay independent; the slopes
    that weight them are smoothed as much as pays.
    """
    every = slice(None, None, FINE // 2)
    t, fine, start = grids[0][every], grids[1], delay
    for _ in range(_ITERATIONS):
        value, slope = (np.interp(t + delay, fine, v, np.nan, np.nan) for v in (smooth[1], slopes[1]))
        use = np.isfinite(value) & np.isfinite(slope) & np.isfinite(slopes[0][every])
        if use.sum() < 4 * _BLOCKS:
            return None
        base = smooth[0][every][use]
        own, residual = _without(base, slope[use]), _without(base, value[use])
        # The noise of the two slopes is independent: their product is information, either one's square is not.
        theirs = _without(base, slopes[0][every][use])
        information = own * theirs
        if information.sum() <= _LEAST_LIKENESS * np.sqrt(_dot(own, own) * _dot(theirs, theirs)):
            return None
        gain = float(np.cov(base, value[use])[0, 1] / np.var(base, ddof=1))
        change = -_dot(own, residual) / (gain * float(information.sum()))
        noise = _dot(own, own) / float(information.sum()) ** 2
        delay += change
        if abs(change) < 0.003 * float(np.sqrt(noise * np.var(residual))):
            break
    if not abs(delay - start) <= reach:
        return None
    offset = float(np.mean(value[use]) - gain * np.mean(base))
    std, drift, drift_std = _uncertainty((t + delay)[use], own * residual, gain * information)
    return _Alignment(delay, std, gain, offset, noise, drift, drift_std)


def _without(base: Array, values: Array) -> Array:
    """What a fit of gain and offset on the base leaves of the values."""
    base, values = base - base.mean(), values - values.mean()
    return np.asarray(values - base * (_dot(base, values) / _dot(base, base)))


def _dot(a: Array, b: Array) -> float:
    return float(np.sum(a * b))  # a threaded product of short vectors takes longer than it saves


def _uncertainty(time: Array, scores: Array, information: Array) -> tuple[float, float, float]:
    """Standard error of the delay, the change of the delay from the start to the end, and that change's error.

    The delay's error is -sum(scores) / sum(information), with scores s r of the part s of the slope that gain and
    offset cannot imitate; its spread is seen in blocks, and its change is the slope of the blocks' delays over time.
    """
    gathered = np.cumsum(np.maximum(information, 0.0))
    block = np.minimum((gathered / gathered[-1] * _BLOCKS).astype(int), _BLOCKS - 1)
    score, weight = np.bincount(block, scores, _BLOCKS), np.bincount(block, information, _BLOCKS)
    std = float(np.sqrt(_BLOCKS / (_BLOCKS - 3.0) * np.sum(score**2)) / weight.sum())
    middle = np.bincount(block, time, _BLOCKS) / np.maximum(np.bincount(block, minlength=_BLOCKS), 1)
    middle -= float(np.sum(weight * middle) / weight.sum())
    spread = float(np.sum(weight * middle**2))
    rate = -float(np.sum(score * middle)) / spread
    left = score + weight * rate * middle
    rate_std = float(np.sqrt(_BLOCKS / (_BLOCKS - 3.0) * np.sum((left * middle) ** 2))) / spread
    return std, rate * float(np.ptp(time)), rate_std * float(np.ptp(time))


def merge(reference: Log, others: Sequence[Log], shared: str) -> Log:
    """Put other loggers' channels on the reference's clock, saying the delay of each and how it was resampled.

    Parameters
    ----------
    reference : gives the clock, and every channel that it has.
    others : give the channels that no log before them has.
    shared : the channel that all recorded, from which the delays are estimated.

    Returns
    -------
    Log : channels of a faster logger are means over the reference's usual step, those of a slower one lie on straight
        lines between its samples; NaN beyond its ends and in its gaps.

    Raises
    ------
    InputError : a delay that cannot be estimated.
    """
    merged = replace(reference, findings=(*reference.findings, *(f for log in others for f in log.findings)))
    step = float(np.median(np.diff(reference.time)))
    for other in others:
        found = _align(reference, other, shared)
        added, how = {}, {}
        for channel in other.channels:
            if channel not in merged:
                added[channel], how[channel] = _resampled(other, channel, reference.time + found.delay, step)
        merged = merged.with_channels(**added)
        findings = _merge_findings(reference, other, shared, found, how)
        merged = replace(merged, findings=(*merged.findings, *findings))
    return merged


def on_one_clock(reference: Log, others: Sequence[Log]) -> Log:
    """Put channels of the same file that stand on other clocks on the reference's, saying how each was resampled.

    Parameters
    ----------
    reference : gives the clock.
    others : logs of channels that count the time from the same moment, so that no delay is estimated.

    Returns
    -------
    Log : channels resampled as by `merge`; those whose samples have the same times are taken as they are.
    """
    added: dict[str, Array] = {}
    how: dict[str, str] = {}
    findings = list(reference.findings)
    step = float(np.median(np.diff(reference.time))) if reference.time.size > 1 else 0.0
    for other in others:
        findings += other.findings
        same = np.array_equal(other.time, reference.time)
        gaps = None if same or other.time.size < 2 else Signal(other.time, other.time).gaps_at(reference.time)
        for channel in other.channels:
            added[channel], words = (
                (other[channel], "") if same else _resampled(other, channel, reference.time, step, gaps)
            )
            if words:
                how[channel] = words
    for words in dict.fromkeys(how.values()):
        names = ", ".join(f"'{name}'" for name, kind in how.items() if kind == words)
        first = next(iter(reference.channels), "time")
        what = f"resampled to the sampling times of '{first}': {names} ({words})"
        remedy = "choose the clock of another group with the key 'group' of the channel 'time'"
        findings.append(Finding(reference.name, what, remedy=remedy))
    return replace(reference.with_channels(**added), findings=tuple(findings))


def _resampled(
    log: Log, channel: str, at: Array, step: float, gaps: NDArray[np.bool_] | None = None
) -> tuple[Array, str]:
    """A channel at other times, and how; ``gaps`` (n,): which times lie in gaps of its clock or beyond its ends."""
    written = np.isfinite(log[channel])
    if written.sum() < 2:
        return np.full(at.size, np.nan), "nothing written"
    whole = bool(written.all())
    signal = Signal(log.time, log[channel]) if whole else Signal(log.time[written], log[channel][written])
    if signal.step < 0.75 * step:
        return signal.averages(at, step), f"means over {step:.4g} s"
    values = np.interp(at, signal.time, signal.values)
    values[gaps if whole and gaps is not None else signal.gaps_at(at)] = np.nan
    return values, "straight lines between samples"


def _merge_findings(reference: Log, other: Log, shared: str, found: _Alignment, how: dict[str, str]) -> list[Finding]:
    what = (
        f"clock is {found.delay:+.4f} s +- {found.std:.4f} s (standard error) from that of {reference.name}, by"
        f" channel '{shared}', which here is {found.gain:.4g} x {reference.name} {found.offset:+.3g}"
    )
    for words in dict.fromkeys(how.values()):
        names = ", ".join(f"'{name}'" for name, kind in how.items() if kind == words)
        what += f"; {names} resampled to its clock ({words})"
    findings = [Finding(other.name, what)]
    if abs(found.drift) > 4.0 * found.drift_std:
        what = f"clock drifts by {found.drift:+.4f} s +- {found.drift_std:.4f} s from start to end"
        findings.append(Finding(other.name, what, remedy="cut the log into shorter runs, or synchronize the loggers"))
    return findings
