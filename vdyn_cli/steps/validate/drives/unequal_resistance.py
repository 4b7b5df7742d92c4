"""Detects drives in which a force resists the motion that the other drives do not have: brakes, tires, a slope.

While the car is driven, its acceleration is a T + b_k + c V^2 + d T' with a, c and d of all drives. On one road and day

    b_k = beta + h_k s + e_k

with the direction h_k of a drive, a slope or wind s, and e_k by weather and place. A common fault moves beta or s; a
fault of one drive moves its e_k, which a fit of all drives would take for a slope or a weaker common fault.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference.robust_fits import least_squares
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.step_policy import STEP_POLICY
from vdyn_cli.steps.validate.drives.driven_samples import Driven, DrivenSamples, driven_samples, joined
from vdyn_cli.steps.validate.drives.span_averages import SPAN

BLOCKS = 8  # of a drive, whose scatter gives the standard error of its constant
LEAST_DRIVEN = 40  # s of driven samples: five for each block
FEWEST_DRIVES = 4  # of three, the two in one direction cannot be told apart
AGREEING = 2.0  # times their number, most squares of the other drives in standard deviations: they agree
FAULT = 0.5  # standard deviation of beta, of the stated rolling resistance: by a fault that all drives share


@dataclass(frozen=True)
class OtherResistance:
    """A drive with another resistance.

    Parameters
    ----------
    drive : its index. force : N/kg, its deceleration beyond that of the other drives. error : its standard error.
    t : ``force`` in standard deviations of what drives differ by.
    """

    drive: int
    force: float
    error: float
    t: float


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
    constant, variance = _constants([seen[k] for k in used])
    known = all(headings[k] for k in used)
    variance = variance + ((STEP_POLICY.road_between if known else STEP_POLICY.slope_between) * GRAVITY) ** 2
    columns = np.column_stack([np.ones(len(used)), [headings[k] for k in used]])
    mean, prior = np.array([stated, 0.0]), np.array([FAULT * abs(stated), STEP_POLICY.drive_slope * GRAVITY])
    whole = _squares(constant, columns, variance, mean, prior)[0]
    without = [_without(k, constant, columns, variance, mean, prior) for k in range(len(used))]
    k = int(np.argmin([one[0] for one in without]))
    left, off, error = without[k]
    t = float(np.sqrt(max(whole - left, 0.0)))
    if t < STEP_POLICY.unequal_t or left > AGREEING * len(used):
        return None
    return OtherResistance(used[k], -off, error, t)


def resistance_finding(log: str, found: OtherResistance, mass: float) -> Finding:
    """The finding on a drive that is left out; ``mass`` with rotating parts, kg."""
    what = (
        f"has {abs(found.force) * mass:.3g} +- {2 * found.error * mass:.2g} N "
        f"{'more' if found.force > 0 else 'less'} resistance than the other drives: brakes or tires, or another slope, "
        "wind or load; this drive is left out"
    )
    remedy = "validate it in a description of its own, or state its direction and wind_speed"
    return Finding(log, what, "", remedy, doubt=True)


def _constants(seen: Sequence[DrivenSamples]) -> tuple[Array, Array]:
    """The constant b of each drive, m/s^2, beside coefficients of all, and its variance by blocks of the drive."""
    rate, columns = joined(seen)
    drive = np.repeat(np.arange(len(seen)), [s.rate.size for s in seen])
    own = (drive[:, None] == np.arange(len(seen))).astype(float)
    found, left = least_squares(np.column_stack([own, columns[:, [0, 2, 3]]]), rate)
    variance = [
        np.var([part.mean() for part in np.array_split(left[drive == k], BLOCKS)], ddof=1) / BLOCKS
        for k in range(len(seen))
    ]
    return found[: len(seen)], np.asarray(variance)


def _squares(y: Array, x: Array, variance: Array, mean: Array, prior: Array) -> tuple[float, Array, Array]:
    """Least sum of squares of y about x beta with the prior of beta; beta, and its covariance."""
    rows = np.vstack([x / np.sqrt(variance)[:, None], np.diag(1.0 / prior)])
    right = np.r_[y / np.sqrt(variance), mean / prior]
    beta = np.linalg.lstsq(rows, right, rcond=None)[0]
    residual = right - rows @ beta
    return float(residual @ residual), np.asarray(beta), np.asarray(np.linalg.inv(rows.T @ rows))


def _without(k: int, y: Array, x: Array, variance: Array, mean: Array, prior: Array) -> tuple[float, float, float]:
    """The squares of the other drives than k; by how much k is off from them, and the standard error of that."""
    others = np.arange(y.size) != k
    squares, beta, covariance = _squares(y[others], x[others], variance[others], mean, prior)
    error = float(np.sqrt(variance[k] + x[k] @ covariance @ x[k]))
    return squares, float(y[k] - x[k] @ beta), error
