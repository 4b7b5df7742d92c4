"""Delay and drift between two loggers' clocks near a coarse delay, by least squares, with standard errors.

For two recordings x (the reference's) and y (the other's) of the same motion::

    y(t + delay + drift (t - at)) = gain x(t) + offset [+ slip V V']

The slip term is used for a wheel speed against the vehicle speed V: slip grows with the tire force and so with the
acceleration, which a delay of the speed would imitate. Both signals are smoothed by the same symmetric kernel, which
shifts neither in time, and weighted by a slope that is smoothed enough to suppress its noise. Standard errors come from
a jackknife over 16 blocks of equal information, so that they hold for autocorrelated differences between the sensors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.clocks.clock_policy import CLOCKS
from vdyn_cli.io.clocks.sampled_signal import FINE, smoothed
from vdyn_cli.quantities.arrays import Array

WIDTHS = (2.0, 8.0, 32.0, 128.0, 512.0)  # smoothing, in steps of the slower logger
_BLOCKS = 16
_ITERATIONS = 30


@dataclass(frozen=True)
class DelayFit:
    """A delay with its standard error, and the drift that remains about it, s and s/s; ``noise`` compares fits."""

    delay: float
    std: float
    gain: float
    offset: float
    noise: float  # variance of the delay for white residuals of variance 1; it scatters less than std
    at: float  # s on the other's clock
    drift: float
    drift_std: float


@dataclass(frozen=True)
class CellMeans:
    """Both recordings as means over fine cells, each on a grid of its own clock; ``width``: smoothing width, s."""

    grids: tuple[Array, ...]
    values: tuple[Array, ...]
    width: float
    vehicle: int | None  # which of the two is the vehicle's speed, where the other is a wheel's


def best_delay_fit(cells: CellMeans, delay: float, rate: float, at: float) -> DelayFit | None:
    """The fit with the smoothing of the weights that gives the least noise; None if none determines a delay.

    Parameters
    ----------
    delay : s, near which it is fitted. rate : corrected drift, s/s. at : s on the reference's clock, of the delay.
    """
    smooth: tuple[Array, ...] = tuple(smoothed(c, 1.0) for c in cells.values)
    slip: tuple[int, Array] | None = None
    found: list[DelayFit] = []
    for times in WIDTHS:
        wide = tuple(smoothed(c, times / WIDTHS[0]) for c in cells.values)
        slopes = tuple(np.gradient(c, cells.width / FINE) for c in wide)
        if cells.vehicle is not None:  # V V' = (V^2 / 2)', smoothed like the signals
            smooth, energy = wide, smoothed(0.5 * cells.values[cells.vehicle] ** 2, times / WIDTHS[0])
            slip = cells.vehicle, np.gradient(energy, cells.width / FINE)
        fit = _refined(cells.grids, (smooth, slopes, slip), (delay, rate, at), 4.0 * times * cells.width / WIDTHS[0])
        found += [fit] if fit is not None else []
    return min(found, key=lambda f: f.noise) if found else None


def _refined(
    grids: tuple[Array, ...],
    recordings: tuple[tuple[Array, ...], tuple[Array, ...], tuple[int, Array] | None],
    clock: tuple[float, float, float],
    reach: float,
) -> DelayFit | None:
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
    return DelayFit(delay, std, gain, offset, noise, middle, drift, drift_std)


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
