"""Removes the error that an eccentric encoder of the wheel repeats at every turn."""

from __future__ import annotations

import numpy as np

from vdyn_cli.inference.robust_fits import ordinary_least_squares
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.shaft.encoder_angles import ANGLES, raw_twist, unwrapped
from vdyn_cli.steps.shaft.policy import SHAFT_POLICY

SMOOTHED = 0.01  # s, mean of the torque before its derivative: below a tenth of a period of a driveline's oscillation


def with_centered_encoder(log: Log, gear_ratio: float) -> tuple[Log, tuple[Finding, ...]]:
    """The log with its wheel angle corrected for an eccentric encoder, and a finding; unchanged where none shows.

        phi = a + T / k + c T^2 + d T^3 + b T' + A sin theta + B cos theta

    phi is the twist by both angles, theta the wheel's angle. The derivative T' of the torque stands for the damping, so
    that an oscillation of the shaft itself is not taken for an error of the encoder; T^2 and T^3 stand for a stiffness
    that changes with the torque, which may vary once per turn, too. The last two terms must explain ``eccentric_share``
    of what the others leave, over ``eccentric_turns``. Each log has its own A and B, because the zero of an incremental
    encoder is arbitrary.

    Parameters
    ----------
    log : shaft_torque (N m), motor_angle and wheel_angle (rad); other logs are returned as they are.
    gear_ratio : turns of motor_angle per turn of the wheel.
    """
    if "twist" in log or "shaft_torque" not in log or not all(name in log for name in ANGLES):
        return log, ()
    twist, turned = raw_twist(log, gear_ratio), unwrapped(log["wheel_angle"])
    columns = np.column_stack([np.ones(twist.size), *torque_columns(log), np.sin(turned), np.cos(turned)])
    good = np.isfinite(twist) & np.isfinite(columns).all(axis=1)
    if np.count_nonzero(good) < 10 or np.ptp(turned[good]) < 2.0 * np.pi * SHAFT_POLICY.eccentric_turns:
        return log, ()
    found, left = ordinary_least_squares(columns[good], twist[good])
    _, before = ordinary_least_squares(columns[good, :-2], twist[good])
    share = 1.0 - float(left @ left) / max(float(before @ before), 1e-300)
    if share < SHAFT_POLICY.eccentric_share:
        return log, ()
    size = np.degrees(np.hypot(found[-2], found[-1]))
    what = f"errs by +-{size:.2g} deg once per turn (eccentric encoder), and is corrected by that"
    got = f"{100 * share:.0f} % of the variance of the twist that the torque does not explain"
    remedy = "center the encoder on the wheel's axis"
    corrected = log.with_channels(wheel_angle=turned + columns[:, -2:] @ found[-2:])
    return corrected, (Finding(f"{log.name}, channel 'wheel_angle'", what, got, remedy, fault=True),)


def torque_columns(log: Log) -> tuple[Array, ...]:
    """Regressors of the twist, (n,) each: torque T (N m), T^2, T^3, and T' (N m/s) of means over ``SMOOTHED``."""
    torque = log["shaft_torque"]
    return torque, torque**2, torque**3, np.gradient(smoothed(torque, log.time), log.time)


def smoothed(signal: Array, time: Array) -> Array:
    """Moving means over ``SMOOTHED`` of a signal (n,)."""
    width = max(round(SMOOTHED / float(np.median(np.diff(time)))), 1)
    return np.asarray(np.convolve(np.pad(signal, width, mode="edge"), np.ones(width) / width, "same")[width:-width])
