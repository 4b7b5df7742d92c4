"""Delay and drift between two loggers' clocks near a coarse delay, by least squares, with standard errors.

For two recordings x (the reference's) and y (the other's) of the same motion::

    y(t + delay + drift (t - at)) = gain x(t) + offset [+ slip]
    slip = s_1 V max(V', 0) + s_2 V min(V', 0) + s_3 V min(V' + a, 0)

The slip terms are used for a wheel's speed against a motion of the vehicle (speed V, acceleration, position): slip
grows with the tire force and so with the acceleration, which a delay of the speed would imitate. An axle without drive
slips only when it brakes, which is faster than a car coasts (a = 1 m/s^2). Where changes are compared, these are of the
slip terms, too. Both signals are smoothed by the same symmetric kernel, which shifts neither in time, and weighted by a
slope that is smoothed enough to suppress its noise. Standard errors come from a jackknife over 16 blocks of equal
information, so that they hold for autocorrelated differences between the sensors. A share of the shift by the slip
terms is added, since slip is not quite linear in the force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import asin, tan

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.clocks.clock_policy import CLOCKS
from vdyn_cli.io.clocks.coarse_delay import compared_slip
from vdyn_cli.io.clocks.sampled_signal import FINE, smoothed
from vdyn_cli.io.clocks.tied_channels import ChannelTie
from vdyn_cli.io.quality.sampled_channel import RADIUS
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY

COASTING = 1.0  # m/s^2, largest usual deceleration of a coasting car: beyond, brakes act
WIDTHS = (2.0, 8.0, 32.0, 128.0, 512.0)  # smoothing, in steps of the slower logger
_BLOCKS = 16
_ITERATIONS = 30
SlipTerms = tuple[int, tuple[Array, ...], float]
"""Index (0, 1) of their grid, the terms, and the share of their shift of the delay that is uncertain."""


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
    tie: ChannelTie
    rolling: int | None  # which of the two grids that of the speed is, where a wheel's slip separates the recordings
    speed: Array | None  # V, on that grid


def best_delay_fit(cells: CellMeans, delay: float, rate: float, at: float) -> DelayFit | None:
    """The fit with the smoothing of the weights that gives the least noise; None if none determines a delay.

    Parameters
    ----------
    delay : s, near which it is fitted. rate : corrected drift, s/s. at : s on the reference's clock, of the delay.
    """
    smooth: tuple[Array, ...] = tuple(smoothed(c, 1.0) for c in cells.values)
    slip: SlipTerms | None = None
    share = 0.0 if cells.speed is None else _nonlinear_slip(cells.speed, cells)
    found: list[DelayFit] = []
    for times in WIDTHS:
        wide = tuple(smoothed(c, times / WIDTHS[0]) for c in cells.values)
        slopes = tuple(np.gradient(c, cells.width / FINE) for c in wide)
        if cells.rolling is not None and cells.speed is not None:  # V V' = (V^2 / 2)', smoothed like the signals
            step = cells.width / FINE
            power = np.gradient(smoothed(0.5 * cells.speed**2, times / WIDTHS[0]), step)
            coast = smoothed(cells.speed, times / WIDTHS[0]) * (COASTING if cells.tie.order == 0 else COASTING / RADIUS)
            parts = (np.maximum(power, 0.0), np.minimum(power, 0.0), np.minimum(power + coast, 0.0))
            smooth, slip = wide, (cells.rolling, tuple(compared_slip(p, step, cells.tie) for p in parts), share)
        fit = _refined(cells.grids, (smooth, slopes, slip), (delay, rate, at), 4.0 * times * cells.width / WIDTHS[0])
        found += [fit] if fit is not None else []
    return min(found, key=lambda f: f.noise) if found else None


def _refined(
    grids: tuple[Array, ...],
    recordings: tuple[tuple[Array, ...], tuple[Array, ...], SlipTerms | None],
    clock: tuple[float, float, float],
    reach: float,
) -> DelayFit | None:
    """Solve sum(slope (y(stamp(t)) - gain x(t) - offset)) = 0 for the delay; None if that determines no delay nearby.

    The channels are smoothed just enough to be interpolated, so that neighboring blocks stay independent; the slopes
    that weight them are smoothed more.

    Parameters
    ----------
    recordings : both channels, their slopes, and the slip terms.
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
        index, terms, share = slip or (0, (), 0.0)
        added = [s[every] if index == 0 else np.interp(warped + delay, fine, s, np.nan, np.nan) for s in terms]
        if added:
            use &= np.all(np.isfinite(added), axis=0)
        base, reference_slope = smooth[0][every][use], slopes[0][every][use]
        space = _basis(base, [s[use] for s in added])
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
    if added:
        shift = _shift(_basis(base, []), slope[use], gain * reference_slope, value[use])
        std = float(np.hypot(std, share * shift))
    return DelayFit(delay, std, gain, offset, noise, middle, drift, drift_std)


def _nonlinear_slip(speed: Array, cells: CellMeans) -> float:
    """Share by which tires slip more than in proportion to the force, at the largest acceleration of a second.

    Magic formula F = limit sin(C atan(x)), C = 1.5, of one axle with half of the load that drives or brakes the car.
    """
    rate = np.abs(np.gradient(smoothed(speed, 1.0 / cells.width), cells.width / FINE))
    known = rate[np.isfinite(rate)]
    if not known.size:
        return 0.0
    largest = float(np.quantile(known, 0.99)) * (1.0 if cells.tie.order == 0 else RADIUS)
    force = float(np.clip(2.0 * largest / GRAVITY, 1e-3, CLOCKS.most_adhesion))
    return 1.5 * tan(asin(force) / 1.5) / force - 1.0


def _shift(space: Array, slope: Array, theirs: Array, value: Array) -> float:
    """Change of the delay, s, if the regression had only the columns of ``space``; arguments as in ``_uncertainty``."""
    own = _without(space, slope)
    return -_dot(own, value) / _dot(own, theirs)


def _basis(base: Array, slip: Sequence[Array]) -> Array:
    """Orthonormal columns for offset, gain and, where given, wheel slip: (n, 2 to 5)."""
    least = 0.01 * sum(_dot(s, s) for s in slip)  # a part that the drive lacks is noise
    columns = [np.ones(base.size), base - base.mean(), *(s for s in slip if _dot(s, s) > least)]
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
        slip, (n, 2 to 5). residual : of the other, without these. information : about the delay, per sample.
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
        # A column may lie in one block, such as the slip of the only braking: without it, its coefficient is zero.
        without = (np.linalg.pinv(left.sum(axis=0) - left, 1e-9) @ (right.sum(axis=0) - right)[:, :, None])[:, k, 0]
    except np.linalg.LinAlgError:
        return 0.0, float("inf")
    return float(whole), float(np.sqrt((_BLOCKS - 1.0) / _BLOCKS * np.sum((without - without.mean()) ** 2)))
