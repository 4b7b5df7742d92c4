"""Delay and drift between two loggers' clocks, with standard errors, from physically related channels.

For two recordings x (the reference's) and y (the other's) of the same motion::

    y(t + delay + drift (t - at)) = gain x(t) + offset [+ slip V V']

The slip term is used for a wheel speed against the vehicle speed V: slip grows with the tire force and so with the
acceleration, which a delay of the speed would imitate. For a speed and an acceleration, the change of the speed over a
second is compared with that of the integral of the acceleration.

The coarse delay, to one sampling step, maximizes the concordance 2 cov(x, y) / (var x + var y + (mean x - mean y)^2),
or the correlation if the units differ, over all delays with enough overlap. Least squares refine it: both signals are
smoothed by the same symmetric kernel, which shifts neither in time, and weighted by a slope that is smoothed enough to
suppress its noise. Standard errors come from a jackknife over 16 blocks of equal information, so that they hold for
autocorrelated differences between the sensors.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.clocks.clock_policy import CLOCKS
from vdyn_cli.io.clocks.sampled_signal import FINE, Signal, smoothed
from vdyn_cli.io.clocks.tied_channels import ChannelTie
from vdyn_cli.quantities.arrays import Array, cumulative_integral
from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given

STATE_DELAY = "state this logger's 'delay' if it is known (0 s: one clock)"
_OTHERS = f"name other channels with 'align_on', or {STATE_DELAY}"
_WIDTHS = (2.0, 8.0, 32.0, 128.0, 512.0)  # smoothing, in steps of the slower logger
_BLOCKS = 16
_LEAST_READINGS = 20  # below, two recordings can be similar by chance at some delay
_ITERATIONS = 30
_MOST_POINTS = 1 << 21  # of the coarse search
_CHANGE = 1.0  # s over which the change of a speed is compared with an acceleration
_SLOW = 8.0  # s, length of the moving mean subtracted from such changes: road slope and tilt vary more slowly
_DRIFT_ROUNDS = 4


@dataclass(frozen=True)
class _Fit:
    delay: float
    std: float
    gain: float
    offset: float
    noise: float  # variance of the delay for white residuals of variance 1; it scatters less than std
    at: float  # s on the other's clock
    drift: float
    drift_std: float


@dataclass(frozen=True)
class _Cells:
    """Both recordings as means over fine cells, each on a grid of its own clock; ``width``: smoothing width, s."""

    grids: tuple[Array, ...]
    values: tuple[Array, ...]
    width: float
    vehicle: int | None  # which of the two is the vehicle's speed, where the other is a wheel's


def clock_difference(reference: Log, other: Log, tie: ChannelTie) -> ClockDifference:
    """Estimate delay and drift of another logger's clock from two physically related channels.

    The drift, with the prior of quartz clocks, is corrected if it exceeds ``drift_determined`` standard errors; the
    delay is then estimated together with it.

    Parameters
    ----------
    reference, other : logs that overlap by at least half of the shorter one. tie : the two channels.

    Raises
    ------
    InputError : a channel is missing, varies too little or too uniformly, matches at no delay or at several, or the
        drift is larger than that of any clock.
    """
    x, y = _signal(reference, tie.first), _signal(other, tie.second)
    where = f"{reference.name}, {other.name}: {tie}"
    coarse = _coarse_delay(x, y, tie, where)
    span = float(np.ptp(x.time) + np.ptp(y.time))
    width = max(_WIDTHS[0] * max(x.step, y.step), FINE * span / _MOST_POINTS)
    grids = tuple(np.arange(s.time[0], s.time[-1], width / FINE) for s in (x, y))
    means = tuple(
        _compared(s, grid, width / FINE, tie, k) for k, (s, grid) in enumerate(zip((x, y), grids, strict=True))
    )
    cells = _Cells(grids, means, width, tie.vehicle)
    first = _best(cells, coarse, 0.0, 0.0)
    if first is None:
        what = "varies too little or too uniformly to separate a delay from a gain and an offset"
        remedy = f"record acceleration and braking as well, {_OTHERS}"
        raise InputError(Finding(where, what, remedy=remedy))
    at = first.at - first.delay
    found, corrected, settled = first, False, False
    drift, std = _with_prior(first.drift, first.drift_std)
    for _ in range(_DRIFT_ROUNDS):
        if settled or abs(drift) <= CLOCKS.drift_determined * std:
            break
        later = _best(cells, found.delay, drift, at)
        if later is None:
            break
        found, corrected, before = later, True, drift
        drift, std = _with_prior(before + later.drift, later.drift_std)
        settled = abs(drift - before) < 0.1 * std
    if abs(drift) <= CLOCKS.drift_determined * std:
        found, corrected = first, False
    _check_drift(drift, std, where)
    return ClockDifference(
        run=reference.name,
        logger=other.name,
        pair=(tie.first, tie.second),
        delay=found.delay,
        delay_std=found.std,
        at=at,
        drift=drift,
        drift_std=std,
        corrected=corrected,
        gain=found.gain,
        offset=found.offset,
        channels=(),
    )


def stated_difference(reference: Log, other: Log, delay: Given) -> ClockDifference:
    """The difference of two clocks whose delay is known; a delay with an uncertainty has the drift prior of quartz.

    Parameters
    ----------
    reference, other : the logs.
    delay : time by which the other's clock is ahead, s; std 0 if both loggers share one clock.

    Raises
    ------
    InputError : with this delay the logs do not overlap enough.
    """
    (first, last), (start, stop) = ((log.time[0], log.time[-1]) for log in (reference, other))
    together = min(last, stop - delay.value) - max(first, start - delay.value)
    if together < CLOCKS.least_overlap * min(last - first, stop - start):
        what = f"does not overlap {reference.name} enough with the stated delay"
        got = f"{start:.6g} s to {stop:.6g} s, minus {delay.value:.6g} s, against {first:.6g} s to {last:.6g} s"
        remedy = "correct 'delay' (time on this clock minus time on the first logger's clock), or remove it"
        raise InputError(Finding(other.name, what, got, remedy))
    drift_std = CLOCKS.prior_drift if delay.std > 0.0 else 0.0
    at = float(np.mean(reference.time[[0, -1]]))
    return ClockDifference(
        run=reference.name,
        logger=other.name,
        pair=("time", "time"),
        delay=delay.value,
        delay_std=delay.std,
        at=at,
        drift=0.0,
        drift_std=drift_std,
        corrected=False,
        gain=1.0,
        offset=0.0,
        channels=(),
    )


def _with_prior(drift: float, std: float) -> tuple[float, float]:
    """Combine a measured drift and its standard error with the prior of quartz clocks.

    A drift that contradicts the prior is returned as measured.

    Parameters
    ----------
    drift, std : s/s; an infinite std returns the prior.
    """
    if abs(drift) > CLOCKS.prior_contradicted * float(np.hypot(std, CLOCKS.prior_drift)):
        return drift, std
    weight = CLOCKS.prior_drift**2 / (CLOCKS.prior_drift**2 + std**2)
    return weight * drift, CLOCKS.prior_drift * float(np.sqrt(1.0 - weight))


def _check_drift(drift: float, std: float, where: str) -> None:
    """Refuse a drift larger than that of any clock.

    Raises
    ------
    InputError : the drift exceeds ``most_drift``; this happens only where the data contradict the prior.
    """
    if abs(drift) > CLOCKS.most_drift:
        what = "the clocks drift apart too fast: the logs are of different runs or a channel is faulty"
        got = (
            f"{1e6 * drift:+.0f} ppm +- {1e6 * std:.0f} ppm; quartz clocks drift by {1e6 * CLOCKS.prior_drift:.0f} ppm"
        )
        remedy = "check which logs belong to this run, and the unit and the sampling rate of their times; or "
        raise InputError(Finding(where, what, got, f"{remedy}{_OTHERS}"))


def _signal(log: Log, channel: str) -> Signal:
    if channel not in log or channel == "time":
        remedy = f"map it for every logger, {_OTHERS}"
        raise InputError(Finding(log.name, f"has no channel '{channel}' to align the loggers on", remedy=remedy))
    written = np.isfinite(log[channel])
    values = log[channel][written]
    if values.size < _LEAST_READINGS:
        what = f"channel '{channel}' has {values.size} readings: {_LEAST_READINGS} are needed to align the clocks"
        raise InputError(Finding(log.name, what, remedy=_OTHERS))
    if np.ptp(values) == 0.0:
        what = f"channel '{channel}' is constant: it cannot align the loggers' clocks"
        raise InputError(Finding(log.name, what, remedy=_OTHERS))
    return Signal(log.time[written], values)


def _compared(signal: Signal, grid: Array, step: float, tie: ChannelTie, side: int) -> Array:
    """Cell means of the compared quantity: the channel, or its change per second, or that of its integral."""
    if tie.order == 0:
        return signal.averages(grid, step)
    higher = side == (1 if tie.order > 0 else 0)
    if higher:
        signal = replace(signal, values=cumulative_integral(signal.time, signal.values))
    cells, half = signal.averages(grid, step), max(round(0.5 * _CHANGE / step), 1)
    change = np.full(cells.size, np.nan)
    if cells.size > 2 * half:
        change[half:-half] = (cells[2 * half :] - cells[: -2 * half]) / (2 * half * step)
    return change - _moving_mean(change, max(round(0.5 * _SLOW / step), 1)) if tie.slopes else change


def _moving_mean(values: Array, half: int) -> Array:
    """Means over ``half`` values on both sides, NaN where fewer exist."""
    mean, width = np.full(values.size, np.nan), 2 * half + 1
    if values.size >= width:
        total, known = (
            np.concatenate([[0.0], np.cumsum(v)]) for v in (np.nan_to_num(values), np.isfinite(values).astype(float))
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            mean[half : values.size - half] = (total[width:] - total[:-width]) / (known[width:] - known[:-width])
    return mean


def _coarse_delay(x: Signal, y: Signal, tie: ChannelTie, where: str) -> float:
    """The delay, s, at which the recordings are most similar on a common grid, to about one grid step.

    Raises
    ------
    InputError : the recordings match at no delay, only with opposite sign, or equally well at two delays.
    """
    span = np.ptp(x.time) + np.ptp(y.time)
    step = max(x.step, y.step, span / _MOST_POINTS)
    grids = (np.arange(s.time[0], s.time[-1] + step / 2.0, step) for s in (x, y))
    a, b = (_compared(s, grid, step, tie, k) for k, (s, grid) in enumerate(zip((x, y), grids, strict=True)))
    likeness = _likeness(a, b, tie.same)
    best = int(np.argmax(likeness))
    lags = (np.arange(likeness.size) - (a.size - 1)) * step
    measure = "concordance" if tie.same else "correlation"
    if likeness[best] < CLOCKS.least_likeness:
        opposite = _likeness(a, -b, tie.same).max() >= CLOCKS.least_likeness
        got = f"best {measure} {likeness[best]:.2f}"
        remedy = f"check the unit for both loggers, {_OTHERS}"
        if opposite:
            remedy = "one logger has the opposite sign: add 'sign: -1' to its channel, or remove it if it is there"
        raise InputError(Finding(where, "the two recordings do not match at any delay", got, remedy))
    miss = 1.0 - likeness
    far = np.flatnonzero(miss > CLOCKS.lost * miss[best])  # where the match is clearly lost, on either side
    left, right = (int(far[far < best].max(initial=-1)), int(far[far > best].min(initial=miss.size)))
    rivals = [i for i in np.flatnonzero(miss < CLOCKS.rival * miss[best]) if i < left or i > right]
    if rivals:
        got = f"{lags[best] + y.time[0] - x.time[0]:.4g} s or {lags[rivals[0]] + y.time[0] - x.time[0]:.4g} s"
        remedy = f"log a non-periodic manoeuvre, {_OTHERS}"
        raise InputError(Finding(where, "the two recordings match at several delays", got, remedy))
    return float(y.time[0] - x.time[0] + lags[best])


def _likeness(a: Array, b: Array, same: bool) -> Array:
    """Concordance, or correlation, of a and b for each lag of b; -1 where they overlap too little."""
    a, b = a - float(np.nanmean(a)), b - float(np.nanmean(a if same else b))
    if not same:
        b = b * float(np.nanstd(a)) / max(float(np.nanstd(b)), 1e-300)
    count, sum_a, sum_b, sum_aa, sum_bb, sum_ab = _lagged_sums(a, b)
    enough = count >= CLOCKS.least_overlap * min(np.isfinite(a).sum(), np.isfinite(b).sum())
    n = np.where(enough, count, 1.0)
    var_a, var_b = sum_aa / n - (sum_a / n) ** 2, sum_bb / n - (sum_b / n) ** 2
    cov = sum_ab / n - sum_a * sum_b / n**2
    least = 1e-9 * (np.nanvar(a) + np.nanvar(b)) + 1e-300
    apart = ((sum_a - sum_b) / n) ** 2
    spread = var_a + var_b + apart if same else 2.0 * np.sqrt(np.maximum(var_a, 0.0) * np.maximum(var_b, 0.0))
    return np.asarray(np.where(enough, 2.0 * cov / np.maximum(spread, least), -1.0))


def _lagged_sums(a: Array, b: Array) -> tuple[Array, ...]:
    """For each lag of b from -(len a - 1): number of common samples, and sums of a, b, a^2, b^2 and a b over them."""
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


def _best(cells: _Cells, delay: float, rate: float, at: float) -> _Fit | None:
    """The fit with the smoothing of the weights that gives the least noise; None if none determines a delay."""
    smooth: tuple[Array, ...] = tuple(smoothed(c, 1.0) for c in cells.values)
    slip: tuple[int, Array] | None = None
    found: list[_Fit] = []
    for times in _WIDTHS:
        wide = tuple(smoothed(c, times / _WIDTHS[0]) for c in cells.values)
        slopes = tuple(np.gradient(c, cells.width / FINE) for c in wide)
        if cells.vehicle is not None:  # V V' = (V^2 / 2)', smoothed like the signals
            smooth, energy = wide, smoothed(0.5 * cells.values[cells.vehicle] ** 2, times / _WIDTHS[0])
            slip = cells.vehicle, np.gradient(energy, cells.width / FINE)
        fit = _refined(cells.grids, (smooth, slopes, slip), (delay, rate, at), 4.0 * times * cells.width / _WIDTHS[0])
        found += [fit] if fit is not None else []
    return min(found, key=lambda f: f.noise) if found else None


def _refined(
    grids: tuple[Array, ...],
    recordings: tuple[tuple[Array, ...], tuple[Array, ...], tuple[int, Array] | None],
    clock: tuple[float, float, float],
    reach: float,
) -> _Fit | None:
    """Solve sum(slope (y(stamp(t)) - gain x(t) - offset)) = 0 for the delay; None if that determines no delay nearby.

    The channels are smoothed just enough to be interpolated, so that neighboring blocks stay independent; the slopes
    that weight them are smoothed more.

    Parameters
    ----------
    recordings : both channels, their slopes, and the slip term with the index (0, 1) of its grid.
    clock : initial delay (s), corrected drift (s/s), and the reference's time (s) to which the delay refers.
    reach : largest accepted change of the delay, s.
    """
    (start, rate, at), (smooth, slopes, slip) = clock, recordings
    every = slice(None, None, FINE // 2)
    t, fine, delay = grids[0][every], grids[1], start
    warped = t + rate * (t - at)
    for _ in range(_ITERATIONS):
        value, slope = (np.interp(warped + delay, fine, v, np.nan, np.nan) for v in (smooth[1], slopes[1]))
        use = np.isfinite(value) & np.isfinite(slope) & np.isfinite(slopes[0][every])
        if use.sum() < 4 * _BLOCKS:
            return None
        base, reference_slope = smooth[0][every][use], slopes[0][every][use]
        if slip is None:
            added = None
        else:
            added = slip[1][every] if slip[0] == 0 else np.interp(warped + delay, fine, slip[1], np.nan, np.nan)
        space = _basis(base, None if added is None else added[use])
        own, residual = _without(space, slope[use]), _without(space, value[use])
        # The noise of the two slopes is independent: their product is unbiased information, a square is not.
        theirs = _without(space, reference_slope)
        information = own * theirs
        if information.sum() <= CLOCKS.least_likeness * np.sqrt(_dot(own, own) * _dot(theirs, theirs)):
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
    std, middle, drift, drift_std = _uncertainty(
        (warped + delay)[use], (slope[use], gain * reference_slope, space), residual, information
    )
    return _Fit(delay, std, gain, offset, noise, middle, drift, drift_std)


def _basis(base: Array, slip: Array | None) -> Array:
    """Orthonormal columns for offset, gain and, where given, wheel slip: (n, 2 or 3)."""
    columns = [np.ones(base.size), base - base.mean(), *([] if slip is None else [slip])]
    return np.linalg.qr(np.column_stack([c / max(float(np.sqrt(_dot(c, c))), 1e-300) for c in columns]))[0]


def _without(space: Array, values: Array) -> Array:
    """The values minus their projection on the orthonormal columns."""
    for column in space.T:
        values = values - column * _dot(column, values)
    return np.asarray(values)


def _dot(a: Array, b: Array) -> float:
    return float(np.sum(a * b))  # a threaded product of short vectors takes longer than it saves


def _uncertainty(
    time: Array, columns: tuple[Array, Array, Array], residual: Array, information: Array
) -> tuple[float, float, float, float]:
    """Standard error of the delay, the time (s) to which it refers, the drift (s/s), and the drift's standard error.

    Delete-one-block jackknife of the linearized regression: all coefficients are estimated again without each block, so
    that the error includes a block that alone separates slip or gain from a delay.

    Parameters
    ----------
    columns : the other's slope, the reference's in the other's unit (each (n,)), and the columns of gain, offset and
        slip, (n, 2 or 3). residual : of the other, without these. information : about the delay, per sample.
    """
    slope, theirs, space = columns
    gathered = np.cumsum(np.maximum(information, 0.0))
    block = np.minimum((gathered / gathered[-1] * _BLOCKS).astype(int), _BLOCKS - 1)
    at = float(np.sum(np.maximum(information, 0.0) * time) / gathered[-1])
    later = (time - at) / max(float(np.ptp(time)), 1e-9)
    std = _jackknife(block, np.column_stack([slope, space]), np.column_stack([theirs, space]), residual, 0)[1]
    instruments = np.column_stack([slope, slope * later, space])
    drift, drift_std = _jackknife(block, instruments, np.column_stack([theirs, theirs * later, space]), residual, 1)
    span = max(float(np.ptp(time)), 1e-9)
    return std, at, drift / span, drift_std / span


def _jackknife(
    block: NDArray[np.int64], instruments: Array, columns: Array, values: Array, k: int
) -> tuple[float, float]:
    """Coefficient k of the instrumental regression of -values on columns, and its delete-one-block standard error."""
    parts = [block == b for b in range(_BLOCKS)]
    left = np.array([instruments[p].T @ columns[p] for p in parts])
    right = np.array([-instruments[p].T @ values[p] for p in parts])
    try:
        whole = np.linalg.solve(left.sum(axis=0), right.sum(axis=0))[k]
        without = np.linalg.solve(left.sum(axis=0) - left, (right.sum(axis=0) - right)[:, :, None])[:, k, 0]
    except np.linalg.LinAlgError:
        return 0.0, float("inf")
    return float(whole), float(np.sqrt((_BLOCKS - 1.0) / _BLOCKS * np.sum((without - without.mean()) ** 2)))
