"""Finds corners of a torque between samples, where one straight line meets another.

Denoising sample by sample rounds a corner off, always to the same side, so that it would excite the half-shafts less
than the driver did. Samples on successive straight lines are therefore fitted as one broken line with free corners
t_k::

    T(t) = a + b t + sum_k c_k max(t - t_k, 0)

solved iteratively with an additional column -1(t > t_k) for each corner, whose coefficient over c_k is the step of t_k
(Muggeo, Statistics in Medicine 22 (2003) 3055). Where a broken line misses samples by more than their noise, they stay
unchanged. The ramp of a shift pause lasts only a few samples; if these lie on a line that joins two long ones, it has
its corners, too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.drive import Points
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.validate.drives.line_fits import STRAIGHT, LineFits

Index = NDArray[np.int64]

SHARP = 4.0  # standard deviations by which the slopes of two lines must differ at a corner
KNOWN = 0.05  # share of the shorter line, the largest uncertainty of the corner's time
FEWEST_IN_RAMP = 3  # samples of a ramp between two long lines: two leave no residual to test
NONE_INSIDE = 0.85  # share of a line's reach without another corner: a line may extend a little beyond one
NEXT = 64  # largest distance of two corners of the same broken line, in spacings
MOST_CORNERS = 10  # corners of one broken line
FIT_STEPS = 8  # iterations of a fit
LIKELY = 4.0  # standard deviations by which a sum of squares may exceed its mean
EDGE = 1e-3  # share of a spacing: a corner this close to a sample is at that sample


@dataclass(frozen=True, eq=False)
class _Broken:
    """A broken line through samples ``first`` to ``end``.

    Parameters
    ----------
    corners : (c,) s. at : times (n,) -> values (n,). misses : residuals of the samples.
    """

    first: int
    end: int
    corners: Array
    at: Callable[[Array], Array]
    misses: Array


def with_corners(
    time: Array, torque: Array, values: Array, lines: tuple[LineFits, LineFits], level: float
) -> tuple[Array, Points]:
    """The denoised values (n,), near corners from broken lines, and the corners between samples.

    Parameters
    ----------
    torque : (n,) samples with white noise of ``level``. values : (n,) denoised sample by sample.
    lines : before and after each sample.
    """
    found = _corners(lines, float(np.median(np.diff(time))))
    found = _with_short_ramps(found, time, torque, lines, level)
    values, times, heights = values.copy(), [], []
    for group, least, most in _groups(found, lines, time.size):
        middle = 0.5 * (time[group] + time[group + 1])
        broken = _fit(time, torque, least, most, middle)
        free = max(broken.misses.size - 2 - 2 * broken.corners.size, 1)
        if _is_noise(broken.misses, level, free):
            values[broken.first : broken.end] = broken.at(time[broken.first : broken.end])
            times.append(broken.corners)
            heights.append(broken.at(broken.corners))
    if not times:
        return values, (np.zeros(0), np.zeros(0))
    at, height = np.concatenate(times), np.concatenate(heights)
    between = off_samples(at, time) & (np.diff(at, prepend=-np.inf) > 0.0)
    return values, (at[between], height[between])


def off_samples(at: Array, time: Array) -> NDArray[np.bool_]:
    """Whether each instant ``at`` (c,), s, differs from all sampling times ``time`` (n,), s."""
    nearest = np.abs(at - time[np.clip(np.searchsorted(time, at) - [[1], [0]], 0, time.size - 1)]).min(axis=0)
    return np.asarray(nearest > EDGE * float(np.median(np.diff(time))))


def _corners(lines: tuple[LineFits, LineFits], spacing: float) -> Index:
    """The sample before each corner: where the slopes of the lines before and after differ most."""
    before, after = lines
    turn = np.abs(after.slopes[1:] - before.slopes[:-1])
    sharp = turn / np.sqrt(before.slope_variance[:-1] + after.slope_variance[1:])
    shorter = np.minimum(before.reach[:-1], after.reach[1:]) * spacing
    unsure = np.sqrt(before.variance[:-1] + after.variance[1:]) > KNOWN * turn * shorter
    sharp[unsure] = 0.0
    found = []
    clear = np.flatnonzero(sharp >= SHARP)
    for i in clear[np.argsort(-sharp[clear], kind="stable")]:
        if sharp[i] >= SHARP:
            found.append(i)
            back, on = (int(NONE_INSIDE * reach) for reach in (before.reach[i], after.reach[i + 1]))
            sharp[max(i - back, 0) : i + on + 1] = 0.0
    return np.sort(np.array(found, dtype=np.int64))


def _with_short_ramps(
    found: Index, time: Array, torque: Array, lines: tuple[LineFits, LineFits], level: float
) -> Index:
    """``found`` with both corners of every ramp that is too short for a line fit but joins two long lines.

    An oscillation also looks straight over so few samples, but does not begin and end on a long line.
    """
    before, after = lines
    ends = np.flatnonzero(_line_ends(time, torque, before, level))
    starts = np.flatnonzero(_line_ends(-time[::-1], torque[::-1], after.time_reversed, level)[::-1])
    pairs = list[int]()
    for i, k in zip(ends.tolist(), np.searchsorted(starts, ends, "right").tolist(), strict=True):
        j = int(starts[k]) if k < starts.size else i
        beside = np.any((found >= i - 1) & (found <= j)) or np.any((ends > i) & (ends < j))
        if FEWEST_IN_RAMP <= j - i - 1 <= STRAIGHT and not beside and _is_ramp(time, torque, (i, j), lines, level):
            pairs += [i, j - 1]
    return np.sort(np.r_[found, np.array(pairs, dtype=np.int64)])


def _line_ends(time: Array, torque: Array, lines: LineFits, level: float) -> NDArray[np.bool_]:
    """Mask (n,) of the samples at which a long line ends: the next sample is not on it."""
    steps = np.diff(time)
    beyond = lines.values[:-1] + lines.slopes[:-1] * steps
    std = np.sqrt(lines.variance[:-1]) + np.sqrt(lines.slope_variance[:-1]) * steps
    return np.append(np.abs(torque[1:] - beyond) > SHARP * np.hypot(std, level), False)


def _is_ramp(time: Array, torque: Array, ends: tuple[int, int], lines: tuple[LineFits, LineFits], level: float) -> bool:
    """Whether the samples between two long lines lie on a line with a sharp corner at each of the ``ends``."""
    i, j = ends
    t, x = time[i + 1 : j], torque[i + 1 : j]
    slope, height = np.polyfit(t - t.mean(), x, 1)
    square = float(np.sum((t - t.mean()) ** 2))
    misses = x - height - slope * (t - t.mean())
    if not _is_noise(misses, level, t.size - 2):
        return False
    end = level * np.sqrt(1.0 / t.size + (t[-1] - t.mean()) ** 2 / square)
    for line, k in zip(lines, ends, strict=True):
        turn = abs(slope - line.slopes[k])
        sharp = turn > SHARP * np.sqrt(level**2 / square + line.slope_variance[k])
        if not sharp or np.hypot(end, np.sqrt(line.variance[k])) > KNOWN * turn * np.ptp(t):
            return False
    return True


def _groups(found: Index, lines: tuple[LineFits, LineFits], count: int) -> list[tuple[Index, int, int]]:
    """Groups of corners joined by straight lines, each with its range of samples (first, end)."""
    before, after = lines
    gap = np.diff(found)
    apart = (after.reach[found[:-1] + 1] + before.reach[found[1:]] < gap - 1) | (gap > NEXT)
    apart &= gap > STRAIGHT
    linked = [g for g in np.split(found, np.flatnonzero(apart) + 1) if g.size]
    spans = []
    for g in (part for whole in linked for part in np.array_split(whole, -(-whole.size // MOST_CORNERS))):
        beside = found[(found < g[0]) | (found > g[-1])]
        least = max(int(g[0] - before.reach[g[0]]), int(np.max(beside[beside < g[0]], initial=-2)) + 2)
        most = min(int(g[-1] + 2 + after.reach[g[-1] + 1]), int(np.min(beside[beside > g[-1]], initial=count)))
        spans.append((g, least, most))
    between = [int(a[-1] + b[0]) for (a, _, _), (b, _, _) in pairwise(spans)]  # twice halfway to the next
    starts, ends = [0, *((k + 1) // 2 + 1 for k in between)], [*(k // 2 + 1 for k in between), count]
    return [(g, max(a, low), min(b, high)) for (g, a, b), low, high in zip(spans, starts, ends, strict=False)]


def _fit(time: Array, torque: Array, first: int, end: int, corners: Array) -> _Broken:
    """The least-squares broken line; ``corners`` are start values."""
    t = time[first:end]
    origin, span = t.mean(), float(np.ptp(t))
    spacing = span / (t.size - 1)

    def columns(at: Array, corners: Array) -> Array:
        return np.column_stack([np.ones(at.size), (at - origin) / span, *np.maximum(at - corners[:, None], 0.0) / span])

    for _ in range(FIT_STEPS):
        steps = -1.0 * (t > corners[:, None]).T
        found = np.linalg.lstsq(np.hstack([columns(t, corners), steps]), torque[first:end], rcond=None)[0]
        turns, moves = found[2 : 2 + corners.size] / span, found[2 + corners.size :]
        moved = np.divide(moves, turns, out=np.zeros_like(moves), where=turns != 0.0)
        moved = np.clip(moved, -2 * spacing, 2 * spacing)
        corners = np.sort(np.clip(corners + moved, t[1], t[-2]))
        if np.abs(moved).max() < EDGE * spacing:
            break
    shape = np.linalg.lstsq(columns(t, corners), torque[first:end], rcond=None)[0]

    def line(at: Array) -> Array:
        return np.asarray(columns(at, corners) @ shape)

    return _Broken(first, end, corners, line, torque[first:end] - line(t))


def _is_noise(misses: Array, level: float, free: int) -> bool:
    """Whether residuals with ``free`` degrees of freedom are consistent with white noise of ``level``."""
    return bool(np.sum(misses**2) / level**2 < free + LIKELY * np.sqrt(2.0 * free))
