"""Smoothing of the noisy speed of a short crossing before it is integrated to a position."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference import white_level
from vdyn_cli.quantities.arrays import Array

SPACING = 0.04  # s between knots: a bump brakes an axle within a tenth of a second
LEAST_BRAKED = 1e-4  # of the mean speed: changes below move the car by less than 0.1 mm on a bump of 1 m
GAP_PENALTY = 1e-8  # on curvature where there is no sample: bridges gaps, and is below any of STIFFNESSES
BRAKING_STD = 0.1  # of the ratio of the true braking by the slopes to the computed one: the wheels' inertia, soft hubs
STIFFNESSES = 10.0 ** np.arange(6.0, -2.1, -0.5)  # grid of the curvature penalty, relative to the samples per knot


@dataclass(frozen=True)
class SmoothSpeed:
    """The smoothed speed and its uncertainty.

    Parameters
    ----------
    value : (n,) m/s, at every sample.
    elapsed : (n,) s, since the middle of the crossing.
    scale_std, ramp_std : standard deviations of the mean, relative, and of the slope, m/s^2.
    """

    value: Array
    elapsed: Array
    scale_std: float
    ramp_std: float


def smooth_speed(time: Array, speed: Array, braked: Array | None = None) -> SmoothSpeed:
    """Penalized linear spline through the measured speed, and the standard deviations of its mean and slope.

    The integral of 0.02 m/s of white noise wanders by a millimeter a second, which changes the load on the flank of a
    bump by some hundred newtons. The speed of a car is smoother than that, but the bump brakes it. So a linear spline
    with knots 40 ms apart is fitted with a penalty on its curvature. The penalty, up to infinity (a straight line),
    minimizes n ln(mean square) + freedom ln n (Schwarz; freedom is the trace of the smoother). The part of the change
    that the bump causes is known but for a factor near 1, which costs at most one degree of freedom instead of one per
    knot: without it the noise of the knots at the bump looks like another shape of the bump.

    Parameters
    ----------
    time, speed : (n,) s, m/s; NaN are skipped, and at least eight must be finite.
    braked : (n,) m/s, change of the speed by the slopes of the bump; its factor is fitted with the prior 1 +-
        ``BRAKING_STD``. None: unknown.

    Source: Eilers and Marx, Statistical Science 11 (1996) 89-121, with straight pieces.
    """
    good = np.isfinite(speed)
    elapsed = time - (time[0] + time[-1]) / 2
    n, mean = int(np.count_nonzero(good)), float(np.mean(speed[good]))
    known = speed[good] - mean
    pieces, free = _pieces(time), 2
    if braked is not None and float(np.std(braked[good])) > LEAST_BRAKED * abs(mean):
        pieces, free = np.column_stack([pieces, braked - np.mean(braked)]), 3
    total = float(known @ known)
    normal, right = pieces[good].T @ pieces[good], pieces[good].T @ known
    if free == 3:
        weight = (white_level(speed, time) / BRAKING_STD) ** 2
        normal[-1, -1], right[-1], total = normal[-1, -1] + weight, right[-1] + weight, total + weight
    bends = np.diff(np.eye(pieces.shape[1] + 2 - free, pieces.shape[1]), 2, axis=0)
    bending = bends.T @ bends * n / pieces.shape[1]
    # In coordinates that diagonalize the normal matrix and the penalty, each penalty only scales the coefficients.
    root = np.linalg.inv(np.linalg.cholesky(normal + GAP_PENALTY * bending))
    resistance, axes = np.linalg.eigh(root @ bending @ root.T)
    way = root.T @ axes
    part = way.T @ right
    resistance[:free] = 0.0  # a straight line does not bend, nor does the effect of the bump
    best, freedom, square, score = part, 0.0, 0.0, np.inf
    for stiffness in (np.inf, *STIFFNESSES):
        with np.errstate(invalid="ignore"):
            kept = np.where(resistance > 0, 1.0 / (1.0 + stiffness * resistance), 1.0)
        left = max((total - float(np.sum((2 - kept) * kept * part**2))) / n, 1e-18)
        own = float(np.sum(kept))
        if n * np.log(left) + own * np.log(n) < score:
            best, freedom, square = kept * part, own, left
            score = n * np.log(left) + own * np.log(n)
    value = mean + pieces @ (way @ best)
    # A curved fit is less certain everywhere; all of this uncertainty is attributed to mean and slope.
    level = np.sqrt(square / n * freedom / 2)
    spread = float(np.std(elapsed[good]))
    return SmoothSpeed(value, elapsed, float(level / abs(np.mean(value))), float(level / spread))


def _pieces(time: Array) -> Array:
    """Basis (n, knots) of the linear spline at the samples."""
    count = max(4, round(float(time[-1] - time[0]) / SPACING))
    place = (time - time[0]) / (time[-1] - time[0]) * (count - 1)
    left = np.minimum(place.astype(np.intp), count - 2)
    shares = np.zeros((time.size, count))
    rows = np.arange(time.size)
    shares[rows, left], shares[rows, left + 1] = left + 1 - place, place - left
    return shares
