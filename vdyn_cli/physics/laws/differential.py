"""An open differential: torque balance of its two side gears."""

from __future__ import annotations

from vdyn_cli.engine.model_builder import Number, Signals

# s, time constant of the side gears. Their natural motion (0.005 kg m^2 on a half-shaft: 300 Hz and more, far above the
# frequencies of interest) is limited to 1 / FOLLOW, for which Runge-Kutta steps of 2 ms are stable.
FOLLOW = 0.8e-3


def side_gears(s: Signals) -> Number:
    """Rate d' of half the difference between the side gears' speeds, left minus right, rad/s^2.

    2 (Js + k t^2 + c t) d' = Tr - Tl

    Parameters
    ----------
    s : torque_left, torque_right T (N m) in the half-shafts while the gears turn at +-d (rad/s) about the carrier,
        side_gear_inertia Js (kg m^2) of each, mean stiffness k (N m/rad) and damping c (N m s/rad) of the half-shafts.

    Notes
    -----
    With t = ``FOLLOW`` the inertia of a gear is increased to J = Js + k t^2 and connected to its half-shaft by a damper
    J / t, so that the half-shaft's inner end turns at +-(d + t d'); the term c t is due to the half-shaft's damping.
    The torques differ by 2 J d': 0.3 % at a shuffle of 12 Hz with half-shafts of 29 and 17 kN m/rad. The energy
    balance holds: kinetic J d^2, dissipated 2 J t d'^2.
    Source: the planetary gear's torque balance; mass scaling as in explicit finite elements.
    """
    inertia = s.side_gear_inertia + FOLLOW * (FOLLOW * s.stiffness + s.damping)
    return (s.torque_right - s.torque_left) / (2.0 * inertia)
