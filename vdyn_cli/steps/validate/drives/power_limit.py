"""Detects a drive torque that the car does not follow above a power: a demand, where the motor or battery limits it.

While the car is driven, its acceleration is a min(T, q/V) + b + c V^2 + d T', with q the product of drive torque T and
speed V at the limit. A wrong scale of speed, torque or radius would change the acceleration at all powers alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference.robust_fits import ordinary_least_squares
from vdyn_cli.quantities.arrays import Array, Mask, filled, spans
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.validate.drives.driven_samples import Driven, driven_samples, joined
from vdyn_cli.steps.validate.drives.ratio_changes import LEAST_NOISE, MAIN_SHARE, SAMPLE_STEP, likelihood_gain
from vdyn_cli.steps.validate.drives.stated_motion import StatedMotion
from vdyn_cli.steps.validate.policy import VALIDATE_POLICY

FEWEST_SAMPLES = 60  # driven samples of all drives: 30 s
TRIED = np.linspace(0.05, 0.95, 37)  # quantiles of T V of the driven samples that are tried as limit
BELOW = 0.1  # of the limit, within which samples are left out: power limits are not sharp
AFTER = 1.0  # s around limited samples that are left out with them: lags of the motor and of filters


@dataclass(frozen=True, eq=False)
class PowerLimit:
    """Where a drive's torque exceeds the power that the car receives.

    Parameters
    ----------
    beyond : (n,) mask of these samples, with margins of ``BELOW`` and ``AFTER``.
    torque : (n,) N m, at most that of the limit.
    power : W, the limit at the wheels. left_out, moving : s, duration of the samples beyond and of the drive.
    """

    beyond: Mask
    torque: Array
    power: float = 0.0
    left_out: float = 0.0
    moving: float = 0.0

    def finding(self, log: str) -> tuple[Finding, ...]:
        """A finding on the parts that are left out; empty where there are none."""
        if not self.left_out:
            return ()
        what = (
            f"above {self.power / 1e3:.3g} kW at the wheels the car accelerates less than the torque requires, below "
            f"as much as it requires: the channel is a demand, and the motor's power is limited; the parts above are "
            f"left out ({self.left_out:.0f} s of {self.moving:.0f} s)"
        )
        remedy = "map the torque that the motor delivers (measured, or from its current) instead of the demand"
        return (Finding(f"{log}, channel 'drive_torque'", what, "", remedy, doubt=True),)


def power_limits(drives: Sequence[Driven], stated: StatedMotion | None) -> tuple[PowerLimit, ...]:
    """Where each drive exceeds the power limit that all of them show; nowhere without a limit.

    Parameters
    ----------
    drives : of one car. stated : of this car; without it, nothing is found.
    """
    limit = _limit(drives, stated) if stated is not None else None
    if limit is None or stated is None:
        return tuple(PowerLimit(np.zeros(time.size, dtype=bool), torque) for time, _, torque in drives)
    return tuple(_beyond(drive, limit, stated) for drive in drives)


def _limit(drives: Sequence[Driven], stated: StatedMotion) -> float | None:
    """The limit of T V, N m m/s; None where the stated acceleration per torque does not hold below one."""
    from scipy.optimize import minimize_scalar

    rate, columns = joined([driven_samples(*drive, SAMPLE_STEP) for drive in drives])
    if rate.size < FEWEST_SAMPLES:
        return None
    torque, speed = columns[:, 0], np.sqrt(columns[:, 2])

    def fit(limited: Array) -> tuple[float, float]:
        found, left = ordinary_least_squares(np.column_stack([limited, columns[:, 1:]]), rate)
        return float(left @ left) / rate.size + LEAST_NOISE**2, float(found[0]) / stated.ratio

    without, _ = fit(torque)
    tried = np.quantile(torque * speed, TRIED)
    best = int(np.argmin([fit(np.minimum(torque, q / speed))[0] for q in tried]))
    around = tried[max(best - 1, 0)], tried[min(best + 1, tried.size - 1)]
    limit = float(minimize_scalar(lambda q: fit(np.minimum(torque, q / speed))[0], bounds=around, method="bounded").x)
    variance, ratio = fit(np.minimum(torque, limit / speed))
    certain = likelihood_gain(rate.size, without, variance) > VALIDATE_POLICY.level_evidence
    clear = certain and without > VALIDATE_POLICY.limit_gain * variance
    return limit if clear and abs(ratio - 1.0) <= MAIN_SHARE else None


def _beyond(drive: Driven, limit: float, stated: StatedMotion) -> PowerLimit:
    time, channels, torque = drive
    speed = filled(time, channels["speed"])
    most = limit / np.maximum(speed, 1e-9)
    mask, moving = np.zeros(time.size, dtype=bool), float(time[-1] - time[0])
    for a, b in spans(torque > (1.0 - BELOW) * most):
        mask |= (time >= time[a] - AFTER) & (time <= time[b - 1] + AFTER)
    left_out = float(np.median(np.diff(time))) * float(np.count_nonzero(mask))
    return PowerLimit(mask, np.minimum(torque, most), limit * stated.ratio * stated.inertia, left_out, moving)
