"""The twist of a half-shaft from encoder angles of its two ends."""

from __future__ import annotations

import numpy as np

from vdyn_cli.inference.robust_fits import ordinary_least_squares
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log

ANGLES = ("motor_angle", "wheel_angle")
ONE_TURN = 2.1 * np.pi  # rad, largest range of a single-turn encoder; a multi-turn one reads more
ROUNDED = 1e-4  # of the largest change, below which a change is that of a rounded number
FEW_STEPS = 5.5  # smallest changes in a change that is compared with a whole number of them: more add up their rounding
WHOLE = 0.1  # of a step, median distance of changes from whole steps; it is 0.25 where they have any size
RESTING = 0.1  # share of unchanged readings, below which differences show the rounding of nearly all of them
WRONG_RATIO = 0.1  # share of the twist's range by which it may drift


def with_twist_of_angles(log: Log, gear_ratio: float) -> Log:
    """The log with the channel twist, from motor_angle and wheel_angle (rad).

    phi = motor_angle / gear_ratio - wheel_angle - zero

    The encoders have arbitrary zeros; the zero is the constant of a line of phi over the torque, so that the twist is
    zero without torque. The fit estimates the rate of the twist; nothing is differentiated.

    Parameters
    ----------
    log : with shaft_torque (N m), NaN where there is no reading.
    gear_ratio : turns of motor_angle per turn of the wheel; assumed exact, as a ratio of numbers of teeth.
    """
    twist = raw_twist(log, gear_ratio)
    good = np.isfinite(twist) & np.isfinite(log["shaft_torque"])
    if np.count_nonzero(good) > 2:
        twist = twist - np.polyfit(log["shaft_torque"][good], twist[good], 1)[1]
    return log.with_channels(twist=twist)


def twist_resolution(log: Log, gear_ratio: float) -> float:
    """Standard deviation of the twist by the resolution of the two encoders, rad.

    An angle in steps q errs by q / sqrt(12). Between two steps it does not change, so that its differences do not show
    this error.
    """
    steps = [_step(unwrapped(log[name])) for name in ANGLES]
    return float(np.hypot(steps[0] / gear_ratio, steps[1]) / 12**0.5)


def _step(angle: Array) -> float:
    """The smallest change between readings (n,), rad, if the others are multiples of it or unchanged; else 0.

    A shaft that turns while it is logged skips many steps at every reading. Then each rounding is independent of the
    last one, and shows in the differences. At a steady speed all its changes are nearly 1 times the smallest.
    """
    changes = np.abs(np.diff(angle[np.isfinite(angle)]))
    moved = changes[changes > ROUNDED * changes.max(initial=0.0)]
    if not moved.size or moved.size > (1.0 - RESTING) * changes.size:
        return 0.0
    step = float(moved.min())
    few = moved[moved < FEW_STEPS * step] / step
    return step if np.median(np.abs(few - np.rint(few))) < WHOLE else 0.0


def ratio_of_angles_doubts(log: Log, gear_ratio: float) -> list[Finding]:
    """A finding where the twist drifts with the wheel angle because the gear ratio is wrong.

    phi = a + T / k + b wheel_angle, where b is the relative error of the ratio; its part of phi must exceed
    ``WRONG_RATIO`` of the torque's. Fewer than ten readings give no finding.
    """
    twist, turned = raw_twist(log, gear_ratio), unwrapped(log["wheel_angle"])
    good = np.isfinite(twist) & np.isfinite(log["shaft_torque"])
    if np.count_nonzero(good) < 10:
        return []
    columns = np.column_stack([np.ones(twist.size), log["shaft_torque"], turned])[good]
    if not columns.any(axis=0).all():
        return []
    slope, _ = ordinary_least_squares(columns, twist[good])
    drift = abs(slope[2]) * float(np.ptp(turned[good]))
    if drift <= WRONG_RATIO * abs(slope[1]) * float(np.ptp(log["shaft_torque"][good])):
        return []
    seen = gear_ratio * (1.0 + slope[2])
    what = f"motor_angle and wheel_angle have the ratio {seen:.6g}, not {gear_ratio:g}: the twist drifts with the angle"
    remedy = f"write 'gear_ratio: {seen:.6g}' under settings, or the ratio of the numbers of teeth"
    return [Finding(log.name, what, "", remedy)]


def unwrapped(angle: Array) -> Array:
    """An angle (n,), rad, without the jumps of a single-turn encoder; NaN is kept."""
    good = np.isfinite(angle)
    if not good.any() or np.ptp(angle[good]) > ONE_TURN:
        return angle
    whole = angle.copy()
    whole[good] = np.unwrap(angle[good])
    return whole


def raw_twist(log: Log, gear_ratio: float) -> Array:
    """The twist (n,), rad, by both angles, with their arbitrary zeros; parameters as of with_twist_of_angles."""
    return np.asarray(unwrapped(log["motor_angle"]) / gear_ratio - unwrapped(log["wheel_angle"]))


def at_shifted_times(time: Array, signal: Array, shift: float) -> Array:
    """A signal (n,) at its times plus ``shift``, s, by a cubic spline; NaN beyond its ends and beside missing samples.

    Straight lines between samples at 200 Hz are wrong by 0.8 % of an oscillation at 8 Hz, more than an encoder's noise.
    """
    from scipy.interpolate import CubicSpline

    good = np.isfinite(signal)
    if np.count_nonzero(good) < 2:
        return np.full(time.size, np.nan)
    there = np.interp(time + shift, time, good.astype(float), left=0.0, right=0.0) == 1.0
    return np.where(there, CubicSpline(time[good], signal[good])(time + shift), np.nan)
