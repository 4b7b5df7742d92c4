"""Torque and initial twist of a half-shaft."""

from __future__ import annotations

from vdyn_cli.engine.model_builder import Number, Signals


def shaft(s: Signals) -> Number:
    """Torque in a torsion bar with material damping, N m.

    T = k phi + c phi'

    with ``twist`` phi (rad) and ``twist_rate`` (rad/s) of its ends against each other, ``stiffness`` k (N m/rad) and
    ``damping`` c (N m s/rad). Assumes no free play; source: SAE 2017-01-1574, equation (26) for the bar.
    """
    return s.stiffness * s.twist + s.damping * s.twist_rate


def rest_twist(s: Signals) -> Number:
    """Initial twist of a half-shaft under a steady torque, rad.

    phi = T / k

    with ``torque`` T (N m) and ``stiffness`` k (N m/rad). Assumes no free play and no damping torque: phi' = 0.
    """
    return s.torque / s.stiffness
