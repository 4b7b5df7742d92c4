"""The speed of a short crossing: a noisy channel, made smooth before it is integrated to a position."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Array

SPACING = 0.04  # s between knots: a bump brakes an axle within a tenth of a second
GAP_PENALTY = 1e-8  # on bends where no sample is: bridges gaps, and stays below any of STIFFNESSES
STIFFNESSES = 10.0 ** np.arange(6.0, -2.1, -0.5)  # of the bending, in units of the samples at a knot


@dataclass(frozen=True)
class SmoothSpeed:
    """A smooth line through the measured speed, and what its noise leaves open.

    Parameters
    ----------
    value : (n,) m/s, at every sample.
    elapsed : (n,) s, since the middle of the crossing.
    scale_std, ramp_std : standard deviations of the level, relative, and of the slope, m/s^2.
    """

    value: Array
    elapsed: Array
    scale_std: float
    ramp_std: float


def smooth_speed(time: Array, speed: Array) -> SmoothSpeed:
    """The line that is as straight as the samples allow, and the errors of its level and slope.

    Integrated as measured, 0.02 m/s of white noise wanders by a millimeter a second, which on the flank of a bump is
    some hundred newtons. A car holds its speed more smoothly than that, but the bump brakes it. So straight pieces
    between knots 40 ms apart are fitted with a penalty on their bends; of all penalties, a straight line among them,
    that of the least n ln(square) + freedom ln n is taken (Schwarz; freedom is the trace of the smoother).

    Parameters
    ----------
    time, speed : (n,) s, m/s; NaN are skipped, and at least eight must be finite.

    Source: Eilers and Marx, Statistical Science 11 (1996) 89-121, with straight pieces.
    """
    good = np.isfinite(speed)
    elapsed = time - (time[0] + time[-1]) / 2
    n, mean = int(np.count_nonzero(good)), float(np.mean(speed[good]))
    known = speed[good] - mean
    pieces = _pieces(time)
    normal, right = pieces[good].T @ pieces[good], pieces[good].T @ known
    bends = np.diff(np.eye(pieces.shape[1]), 2, axis=0)
    bending = bends.T @ bends * n / pieces.shape[1]
    # In coordinates where the samples' weight and the bending are both diagonal, every penalty is a division.
    root = np.linalg.inv(np.linalg.cholesky(normal + GAP_PENALTY * bending))
    resistance, axes = np.linalg.eigh(root @ bending @ root.T)
    way = root.T @ axes
    part = way.T @ right
    resistance[:2] = 0.0  # a straight line does not bend
    total = float(known @ known)
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
    # A line that bends is less certain everywhere; all of that is attributed to level and slope.
    level = np.sqrt(square / n * freedom / 2)
    spread = float(np.std(elapsed[good]))
    return SmoothSpeed(value, elapsed, float(level / abs(np.mean(value))), float(level / spread))


def _pieces(time: Array) -> Array:
    """(n, knots): the share of each knot in each sample, straight between knots."""
    count = max(4, round(float(time[-1] - time[0]) / SPACING))
    place = (time - time[0]) / (time[-1] - time[0]) * (count - 1)
    left = np.minimum(place.astype(np.intp), count - 2)
    shares = np.zeros((time.size, count))
    rows = np.arange(time.size)
    shares[rows, left], shares[rows, left + 1] = left + 1 - place, place - left
    return shares
