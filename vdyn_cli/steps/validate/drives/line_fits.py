"""Straight lines that end at every sample of a noisy signal, each as long as the signal is straight.

A line through a sample and its neighbors to one side is extended as long as the confidence interval of its end
intersects those of all shorter lines (intersection of confidence intervals: Katkovnik, IEEE Trans. Signal Process. 47
(1999) 2567).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array

REACHES = (2, 4, 8, 16, 32, 64, 128)  # samples to one side
LONGEST_SIDE = 1.5  # s to one side
WIDTH = 2.0  # half width of the confidence intervals, in standard deviations
STRAIGHT = 8  # fewest samples of a line whose slope is used: an oscillation looks straight over fewer


@dataclass(frozen=True, eq=False)
class LineFits:
    """The line that ends at every sample; all arrays are (n,).

    Parameters
    ----------
    values, variance : of the line's end. reach : number of further samples of the line.
    slopes, slope_variance : of the line; the variance is infinite where the line is too short.
    """

    values: Array
    variance: Array
    slopes: Array
    slope_variance: Array
    reach: NDArray[np.int64]

    @property
    def time_reversed(self) -> LineFits:
        """The fits with reversed time."""
        values, variance, reach = self.values[::-1], self.variance[::-1], self.reach[::-1]
        return LineFits(values, variance, -self.slopes[::-1], self.slope_variance[::-1], reach)


def lines_before(time: Array, values: Array, level: float) -> LineFits:
    """The lines through the samples before each sample.

    Parameters
    ----------
    time : (n,) s, rising. values : (n,). level : standard deviation of the white noise, in the unit of values.
    """
    best, variance = values.copy(), np.full(values.size, level**2)
    slopes, slope_variance = np.zeros(values.size), np.full(values.size, np.inf)
    reached = np.zeros(values.size, dtype=np.int64)
    low, high = values - WIDTH * level, values + WIDTH * level
    going = np.ones(values.size, dtype=bool)
    spacing = float(np.median(np.diff(time)))
    one = window = _samples(values)
    for reach in REACHES:
        if reach * spacing > LONGEST_SIDE or reach >= values.size:
            break
        window = _joined(time, window, window)
        line, spread, slope, square = _line_ends(_joined(time, window, one), reach)
        sigma = level * np.sqrt(spread)
        lower, upper = np.maximum(low, line - WIDTH * sigma), np.minimum(high, line + WIDTH * sigma)
        going &= (lower <= upper) & (np.arange(values.size) >= reach)
        best, variance = np.where(going, line, best), np.where(going, sigma**2, variance)
        reached = np.where(going, reach, reached)
        straight = going & (reach >= STRAIGHT)
        slopes = np.where(straight, slope, slopes)
        slope_variance = np.where(straight, level**2 / square, slope_variance)
        low, high = np.where(going, lower, low), np.where(going, upper, high)
    return LineFits(best, variance, slopes, slope_variance, reached)


def lines_after(time: Array, values: Array, level: float) -> LineFits:
    """The lines through the samples after each sample.

    Parameters
    ----------
    time : (n,) s, rising. values : (n,). level : standard deviation of the white noise, in the unit of values.
    """
    return lines_before(-time[::-1], values[::-1], level).time_reversed


@dataclass(frozen=True, eq=False)
class _Sums:
    """Sums over the ``count`` samples up to each one that has so many: of t, t^2, x and t x; (n - count + 1,) each.

    t is the time since the last of the samples, s; x are their values.
    """

    count: int
    t: Array
    tt: Array
    x: Array
    tx: Array


def _samples(values: Array) -> _Sums:
    """The sums of windows of one sample."""
    zero = np.zeros(values.size)
    return _Sums(1, zero, zero, values, zero)


def _joined(time: Array, late: _Sums, early: _Sums) -> _Sums:
    """The sums over the samples of ``late`` together with those before them (``early``)."""
    count, n = late.count + early.count, time.size
    t, tt, x, tx = (v[: n - count + 1] for v in (early.t, early.tt, early.x, early.tx))
    d = time[early.count - 1 : n - late.count] - time[count - 1 :]
    return _Sums(
        count,
        late.t[early.count :] + t + early.count * d,
        late.tt[early.count :] + tt + 2.0 * d * t + early.count * d**2,
        late.x[early.count :] + x,
        late.tx[early.count :] + tx + d * x,
    )


def _line_ends(s: _Sums, reach: int) -> tuple[Array, Array, Array, Array]:
    """Straight lines through each sample and ``reach`` before it, by least squares, for unit noise.

    Returns
    -------
    (n,) each: value and variance of the line's end, slope, and inverse of the slope's variance.
    """
    middle, mean = s.t / s.count, s.x / s.count
    square = s.tt - s.t * middle
    slope = (s.tx - s.t * mean) / square
    ends = mean - slope * middle
    spread = 1.0 / s.count + middle**2 / square
    pad = np.zeros(reach)
    return np.r_[pad, ends], np.r_[pad + 1.0, spread], np.r_[pad, slope], np.r_[pad + 1.0, square]
