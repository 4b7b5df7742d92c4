"""The driveline between the torque sensor and the driven wheels."""

from __future__ import annotations

from vdyn_cli.engine.maths import where
from vdyn_cli.engine.model_builder import Number, Signals


def drive(s: Signals) -> Number:
    """Drive force at the tire contacts, N.

    F = eta T i / r for T >= 0, (1 + q (1/eta - 1)) T i / r for T < 0

    Parameters
    ----------
    s : drive_torque T in N m at the driveline's input, gear_ratio i (turns of the sensor's shaft per turn of the
        wheel), wheel_radius r in m, driveline_efficiency eta, recuperation_loss q.

    Notes
    -----
    eta includes the losses of gears and bearings under load, which take from the power that enters: from the motor's
    while it drives, from the wheels' under recuperation (q = 1: F = T i / (eta r)). Torques estimated by a controller
    often hold eta for both signs (q = -1: F = eta T i / r to first order in 1 - eta).
    """
    force, loss = s.drive_torque * s.gear_ratio / s.wheel_radius, 1.0 / s.driveline_efficiency - 1.0
    return force * where(s.drive_torque < 0, 1.0 + s.recuperation_loss * loss, s.driveline_efficiency)


def spin_loss(s: Signals) -> Number:
    """Loss between the torque's sensor and the driven wheels, N m at the wheels: T = c V / r, zero in the baseline.

    Parameters
    ----------
    s : viscous c in N m s, speed V in m/s, wheel_radius r in m. Assumes driven wheels that roll with little slip.
    """
    return s.viscous * s.speed / s.wheel_radius


def dry_loss(s: Signals) -> Number:
    """Constant loss between the torque's sensor and the half-shafts, N m at the wheels; zero in the baseline.

    T = T0 s

    Parameters
    ----------
    s : dry_loss T0 in N m, sense s (-1 to 1, see ``standstill_friction``).
    """
    return s.dry_loss * s.sense


def driveline(s: Signals) -> Number:
    """Spin loss of the driveline, N at the tire contacts, against the motion; independent of the torque.

    F = (F0 + c V) s

    Source: a line over speed, the first two terms of the road load of SAE J2263.

    Parameters
    ----------
    s : driveline_drag F0 in N, driveline_viscous c in N s/m, speed m/s, sense s (-1 to 1, see ``standstill_friction``),
        share (of the driven wheels that this call represents).
    """
    return (s.driveline_drag + s.driveline_viscous * s.speed) * s.sense
