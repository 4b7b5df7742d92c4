"""Detects drives in which a force resists the motion that the other drives do not have: brakes, tires, a slope.

While the car is driven, its acceleration is a T + b_k + c V^2 + d T' with a, c and d of all drives. On one road and day

    b_k = beta + h_k s + e_k

with the direction h_k of a drive, a slope or wind s, and e_k by weather and place. A common fault moves beta or s; a
fault of one drive moves its e_k, which a fit of all drives would take for a slope or a weaker common fault.

Where directions are not stated, usual slopes may hide such a fault. But drives that agree on the description far better
than slopes differ show how little e_k scatters on their road; a drive is then compared with that scatter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.inference.robust_fits import least_squares_with_prior, ordinary_least_squares
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.validate.drives.driven_samples import Driven, DrivenSamples, driven_samples, joined
from vdyn_cli.steps.validate.drives.span_averages import SPAN
from vdyn_cli.steps.validate.policy import VALIDATE_POLICY

BLOCKS = 8  # of a drive, whose scatter gives the standard error of its constant
LEAST_DRIVEN = 40  # s of driven samples: five for each block
FEWEST_DRIVES = 4  # of three, the two in one direction cannot be told apart
AGREEING = 2.0  # times their number, most squares of the other drives in standard deviations: they agree
SHARED = [0, 2, 3]  # columns whose coefficients all drives share
FAULT = 0.5  # standard deviation of beta, of the stated rolling resistance: by a fault that all drives share


@dataclass(frozen=True)
class OtherResistance:
    """A drive with another resistance.

    Parameters
    ----------
    drive : its index. force : N/kg, its deceleration beyond that of the other drives. error : its standard error.
    """

    drive: int
    force: float
    error: float


def other_resistance(drives: Sequence[Driven], headings: Sequence[float], stated: float) -> OtherResistance | None:
    """The drive whose resistance differs from all others', if there is one and the others agree.

    Parameters
    ----------
    drives : of one car. headings : +1 out, -1 back, 0 unknown. stated : beta of the car, m/s^2.
    """
    seen = [driven_samples(*drive, SPAN) for drive in drives]
    used = [k for k, one in enumerate(seen) if one.time.size * SPAN >= LEAST_DRIVEN]
    if len(used) < FEWEST_DRIVES:
        return None
    constant, variance, _ = _constants([seen[k] for k in used])
    known = all(headings[k] for k in used)
    variance = variance + ((VALIDATE_POLICY.road_between if known else VALIDATE_POLICY.slope_between) * GRAVITY) ** 2
    columns = np.column_stack([np.ones(len(used)), [headings[k] for k in used]])
    mean, prior = np.array([stated, 0.0]), np.array([FAULT * abs(stated), VALIDATE_POLICY.drive_slope * GRAVITY])
    whole = least_squares_with_prior(constant, columns, variance, mean, prior)[0]
    without = [_without(k, constant, columns, variance, mean, prior) for k in range(len(used))]
    k = int(np.argmin([one[0] for one in without]))
    left, off, error = without[k]
    t = float(np.sqrt(max(whole - left, 0.0)))
    if t >= VALIDATE_POLICY.unequal_t and left <= AGREEING * len(used):
        return OtherResistance(used[k], -off, error)
    lone = _beyond_scatter([seen[k] for k in used], stated)
    return None if lone is None else replace(lone, drive=used[lone.drive])


def _beyond_scatter(seen: Sequence[DrivenSamples], stated: float) -> OtherResistance | None:
    """The drive that is beyond the scatter of the others, if these agree on ``stated``, m/s^2, far better than it.

    With the m others' constants b_j, of mean b and scatter s, and the mean residual b_k of drive k by their fit,

        t = (b_k - b) / (s sqrt(1 + 1/m))

    has Student's distribution with m - 1 degrees of freedom, if all are drawn alike.
    """
    from scipy.special import stdtr

    m, found = len(seen) - 1, []
    for k, one in enumerate(seen):
        others = [other for j, other in enumerate(seen) if j != k]
        constant, variance, shared = _constants(others)
        off = float(np.mean(one.rate - one.columns[:, SHARED] @ shared) - constant.mean())
        error = float(np.sqrt(max(np.var(constant, ddof=1), variance.mean()) * (1.0 + 1.0 / m)))
        found.append((off, error, abs(float(constant.mean()) - stated)))
    k = max(range(len(found)), key=lambda i: abs(found[i][0]) / found[i][1])
    off, error, beside = found[k]
    chance = len(seen) * 2.0 * float(stdtr(m - 1, -abs(off) / error))
    if chance > VALIDATE_POLICY.odd_drive_chance or beside > VALIDATE_POLICY.odd_drive_others * abs(off):
        return None
    return OtherResistance(k, -off, error)


def resistance_finding(log: str, found: OtherResistance, mass: float) -> Finding:
    """The finding on a drive that is left out; ``mass`` with rotating parts, kg."""
    what = (
        f"has {abs(found.force) * mass:.3g} +- {2 * found.error * mass:.2g} N "
        f"{'more' if found.force > 0 else 'less'} resistance than the other drives: brakes, tires, drag or a torque "
        "that does not reach the wheels, or another slope, wind or load; this drive is left out"
    )
    remedy = "validate it in a description of its own, or state its direction and wind_speed"
    return Finding(log, what, "", remedy, doubt=True)


def _constants(seen: Sequence[DrivenSamples]) -> tuple[Array, Array, Array]:
    """The constant b of each drive, m/s^2, and its variance by blocks of the drive; the coefficients of all (3,)."""
    rate, columns = joined(seen)
    drive = np.repeat(np.arange(len(seen)), [s.rate.size for s in seen])
    own = (drive[:, None] == np.arange(len(seen))).astype(float)
    found, left = ordinary_least_squares(np.column_stack([own, columns[:, SHARED]]), rate)
    variance = [
        np.var([part.mean() for part in np.array_split(left[drive == k], BLOCKS)], ddof=1) / BLOCKS
        for k in range(len(seen))
    ]
    return found[: len(seen)], np.asarray(variance), found[len(seen) :]


def _without(k: int, y: Array, x: Array, variance: Array, mean: Array, prior: Array) -> tuple[float, float, float]:
    """The squares of the other drives than k; by how much k is off from them, and the standard error of that."""
    others = np.arange(y.size) != k
    squares, beta, covariance = least_squares_with_prior(y[others], x[others], variance[others], mean, prior)
    error = float(np.sqrt(variance[k] + x[k] @ covariance @ x[k]))
    return squares, float(y[k] - x[k] @ beta), error
