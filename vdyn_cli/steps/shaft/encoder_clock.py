"""Finds a delay between the sensors of a half-shaft's two ends, and compensates it.

A motor sensor that is logged late by d relative to the wheel's changes the twist to first order by -d times the speed:
2 ms at 20 rad/s is 0.04 rad, as much as a hard tip-in.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.inference import white_level
from vdyn_cli.quantities.arrays import Array, Mask, cumulative_integral
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.shaft.encoder_angles import ANGLES, at_shifted_times, raw_twist, unwrapped
from vdyn_cli.steps.shaft.encoder_eccentricity import smoothed, torque_columns
from vdyn_cli.steps.shaft.policy import SHAFT_POLICY

SPEEDS = ("motor_speed", "wheel_speed")
LEAST_CHANGE = 1.0  # rad/s of the wheel's speed in a log, below which a delay hardly changes its twist
ROUNDS = 3  # of estimating the delay, which is of first order, and compensating it


def with_aligned_ends(logs: Sequence[Log], gear_ratio: float) -> tuple[list[Log], float, tuple[Finding, ...]]:
    """The logs with the motor's sensor on the clock of the wheel's, its delay in s, and a finding; unchanged without.

        phi = a + b t + e theta + T / k + c T^2 + d T^3 + f T' - delay omega

    phi is the twist by both angles, or the integral of the difference of both speeds; theta and omega are the wheel's
    angle and speed; b and e stand for errors of the speeds' zeros and gains; powers and derivative of the torque T for
    a nonlinear stiffness and a damping. The delay is that of all logs, must explain ``late_end_share`` of what the
    others leave, and exceeds ``delay_std`` standard deviations: the integrated noise of speeds drifts as a speed does.

    Parameters
    ----------
    logs : shaft_torque (N m), and both angles (rad) or both speeds (rad/s); where one has a twist, or lacks these, all
        are returned as they are.
    gear_ratio : turns of the motor's channel per turn of the wheel.
    """
    ends = next((p for p in (ANGLES, SPEEDS) if logs and all(_has(log, p) for log in logs)), None)
    if ends is None:
        return list(logs), 0.0, ()
    aligned, delay, first = list(logs), 0.0, 0.0
    for _ in range(ROUNDS):
        more, share = _delay(aligned, ends, gear_ratio)
        if not delay:
            first = share
        if first < SHAFT_POLICY.late_end_share:
            return list(logs), 0.0, ()
        delay += more
        aligned = [_earlier(log, ends[0], delay) for log in logs]
    late = f"{1e3 * abs(delay):.2g} ms {'late' if delay > 0 else 'early'}"
    what = f"is logged {late} relative to {ends[1]}, and is shifted by that"
    got = f"explains {100 * first:.0f} % of the variance of the twist that the torque does not explain"
    remedy = "sample both ends of the shaft at the same time, with the same filters"
    return aligned, delay, (Finding(f"channel '{ends[0]}'", what, got, remedy, fault=True, doubt=True),)


def _has(log: Log, ends: tuple[str, str]) -> bool:
    return "twist" not in log and "shaft_torque" in log and all(name in log for name in ends)


def _delay(logs: Sequence[Log], ends: tuple[str, str], gear_ratio: float) -> tuple[float, float]:
    """The delay of the motor's sensor, s, and the share of the variance that it explains, both 0 where none is seen."""
    both = whole = own = variance = 0.0
    for log in logs:
        columns, twist, speed = _signals(log, ends, gear_ratio)
        good = np.isfinite(twist) & np.isfinite(speed) & np.isfinite(columns).all(axis=1)
        if np.count_nonzero(good) <= columns.shape[1] or np.ptp(speed[good]) < LEAST_CHANGE:
            continue
        basis = np.linalg.qr(columns[good] / np.maximum(np.abs(columns[good]).max(axis=0), 1e-300))[0]
        left = np.column_stack([twist, speed])[good]
        left -= basis @ (basis.T @ left)
        squares = left.T @ left
        both, whole, own = both + float(squares[0, 1]), whole + float(squares[0, 0]), own + float(squares[1, 1])
        variance += _variance(log, ends, gear_ratio, left[:, 1], good)
    if both**2 <= SHAFT_POLICY.delay_std**2 * variance:
        return 0.0, 0.0
    return -both / own, both**2 / (own * whole)


def _variance(log: Log, ends: tuple[str, str], gear_ratio: float, weights: Array, good: Mask) -> float:
    """The variance, by the sensors' noise, of a sum of twists with ``weights`` (m,): those of the ``good`` samples.

    The noise of a twist by angles is white; by speeds it is the integral of a white one.
    """
    motor, wheel = (log[name][good] for name in ends)
    if ends == ANGLES:
        motor, wheel = unwrapped(motor), unwrapped(wheel)
    else:
        weights = np.cumsum(weights[::-1])[::-1] * np.gradient(log.time[good])
    return float(weights @ weights) * white_level(motor / gear_ratio - wheel, log.time[good]) ** 2


def _signals(log: Log, ends: tuple[str, str], gear_ratio: float) -> tuple[Array, Array, Array]:
    """The columns (n, k) beside the delay, the twist (n,) rad, and the wheel's speed (n,) rad/s."""
    if ends == ANGLES:
        twist, turned = raw_twist(log, gear_ratio), unwrapped(log["wheel_angle"])
        speed = np.gradient(smoothed(turned, log.time), log.time)
    else:
        speed, motor = log["wheel_speed"], log["motor_speed"]
        good = np.isfinite(speed) & np.isfinite(motor)
        twist, turned = np.full((2, log.time.size), np.nan)
        rate = motor[good] / gear_ratio - speed[good]
        twist[good], turned[good] = (cumulative_integral(log.time[good], x) for x in (rate, speed[good]))
    return np.column_stack([np.ones(twist.size), log.time, turned, *torque_columns(log)]), twist, speed


def _earlier(log: Log, name: str, delay: float) -> Log:
    """The log with one channel (n,) shifted earlier by ``delay``, s; NaN beyond its ends."""
    signal = unwrapped(log[name]) if name in ANGLES else log[name]
    return log.with_channels(**{name: at_shifted_times(log.time, signal, delay)})
