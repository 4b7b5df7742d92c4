"""The coarse delay between two loggers' clocks: the one at which two related recordings are most similar.

The coarse delay, to one sampling step, maximizes the concordance 2 cov(x, y) / (var x + var y + (mean x - mean y)^2),
or the correlation if the units differ, over all delays with enough overlap. For a speed and an acceleration, the change
of the speed over a second is compared with that of the integral of the acceleration.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vdyn_cli.io.clocks.clock_policy import CLOCKS
from vdyn_cli.io.clocks.sampled_signal import Signal
from vdyn_cli.io.clocks.tied_channels import ChannelTie
from vdyn_cli.quantities.arrays import Array, cumulative_integral
from vdyn_cli.quantities.errors import Finding, InputError

STATE_DELAY = "state this logger's 'delay' if it is known (0 s: one clock)"
OTHER_CHANNELS = (
    "map a wheel speed of this logger if it has one, select another pair at the top level (such as 'align_on: [speed, "
    f"wheel_speed]', the first logger's channel first), leave out this logger and its logs, or {STATE_DELAY}"
)
MOST_POINTS = 1 << 21  # of the coarse search
_CHANGE = 1.0  # s over which the change of a speed is compared with an acceleration
_SLOW = 8.0  # s, length of the moving mean subtracted from such changes: road slope and tilt vary more slowly


def compared_means(signal: Signal, grid: Array, step: float, tie: ChannelTie, side: int) -> Array:
    """Cell means (m,) of the compared quantity: the channel, or its change per second, or that of its integral.

    Parameters
    ----------
    grid : (m,) s, middles of the cells. step : their width, s. side : which of the tie's channels it is, 0 or 1.
    """
    if tie.order != 0 and side == (1 if tie.order > 0 else 0):
        signal = replace(signal, values=cumulative_integral(signal.time, signal.values))
    return _compared(signal.averages(grid, step), step, tie)


def compared_slip(cells: Array, step: float, tie: ChannelTie) -> Array:
    """The compared quantity (m,) of a part of the wheel's speed, from its cell means (m,); arguments as above."""
    integrated = tie.order != 0 and tie.wheel == (1 if tie.order > 0 else 0)
    whole = np.where(np.isfinite(cells), np.nancumsum(cells) * step, np.nan) if integrated else cells
    return _compared(whole, step, tie)


def _compared(cells: Array, step: float, tie: ChannelTie) -> Array:
    """The cell means, or their change per second."""
    if tie.order == 0:
        return cells
    half = max(round(0.5 * _CHANGE / step), 1)
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


def coarse_delay(x: Signal, y: Signal, tie: ChannelTie, where: str) -> float:
    """The delay, s, at which the recordings are most similar on a common grid, to about one grid step.

    Parameters
    ----------
    x, y : the recordings of the tie's first and second channel. where : place of a finding.

    Raises
    ------
    InputError : the recordings match at no delay, only with opposite sign, or equally well at two delays.
    """
    span = np.ptp(x.time) + np.ptp(y.time)
    step = max(x.step, y.step, span / MOST_POINTS)
    grids = (np.arange(s.time[0], s.time[-1] + step / 2.0, step) for s in (x, y))
    a, b = (compared_means(s, grid, step, tie, k) for k, (s, grid) in enumerate(zip((x, y), grids, strict=True)))
    likeness = _likeness(a, b, tie.same)
    best = int(np.argmax(likeness))
    lags = (np.arange(likeness.size) - (a.size - 1)) * step
    measure = "concordance" if tie.same else "correlation"
    if likeness[best] < CLOCKS.least_likeness:
        opposite = _likeness(a, -b, tie.same).max() >= CLOCKS.least_likeness
        got = f"best {measure} {likeness[best]:.2f}"
        remedy = f"check the unit for both loggers, {OTHER_CHANNELS}"
        if opposite:
            remedy = "one logger has the opposite sign: add 'sign: -1' to its channel, or remove it if it is there"
        if max(x.time[0], y.time[0]) > min(x.time[-1], y.time[-1]):
            both = [f"{s.time[0]:.6g} to {s.time[-1]:.6g} s" for s in (x, y)]
            got += f"; their times do not overlap: {both[1]}, against {both[0]} of the first logger"
            remedy = f"check that both logs are of one run; {remedy}"
        raise InputError(Finding(where, "no match with the first logger at any delay", got, remedy))
    miss = 1.0 - likeness
    far = np.flatnonzero(miss > CLOCKS.lost * miss[best])  # where the match is clearly lost, on either side
    left, right = (int(far[far < best].max(initial=-1)), int(far[far > best].min(initial=miss.size)))
    rivals = [i for i in np.flatnonzero(miss < CLOCKS.rival * miss[best]) if i < left or i > right]
    if rivals:
        got = f"{lags[best] + y.time[0] - x.time[0]:.4g} s or {lags[rivals[0]] + y.time[0] - x.time[0]:.4g} s"
        remedy = f"log a non-periodic manoeuvre, {OTHER_CHANNELS}"
        raise InputError(Finding(where, "match with the first logger at several delays", got, remedy))
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
