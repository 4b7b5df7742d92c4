"""Dry friction that opposes motion and holds at rest: rolling tires, brakes, gear teeth.

Their laws have a signal ``sense`` s in [-1, 1]: the acting share of the full friction, with its direction. Small models
compute it from the speed alone (``turned``) and creep at rest. The vehicle model has a bristle for each contact (LuGre
type), which deflects until it slips, and rests without creep: ``bristle_rate`` and ``bristle_sense``.
"""

from __future__ import annotations

from vdyn_cli.engine.maths import soft_abs, tanh
from vdyn_cli.engine.model_builder import Number, Signals

STANDSTILL = 0.05  # m/s, over which friction changes its sign with the direction of motion; exactly 1 above 1 m/s
BEND = 2e-3  # m, deflection at which a bristle slips
QUICKEST = 5e-3  # s, shortest time constant of a bristle, for a fixed integration step
STILL = 1e-4  # m/s, below which a bristle does not creep
SLIDING = 0.1  # m/s, above which the damping of a bristle vanishes


def turned(speed: Number) -> Number:
    """Sense of friction from the speed alone, tanh(V / 0.05 m/s)."""
    return tanh(speed / STANDSTILL)


def bristle_rate(s: Signals) -> Number:
    """Rate of a bristle's deflection between two dry surfaces, 1/s.

    z' = (v - |v| z) / (l + t0 |v|)

    At small deflections z' = v/l: a spring. At z = 1 it slips: z' = 0. The rate does not exceed 1/t0.

    Parameters
    ----------
    s : speed v m/s (of one surface over the other), bend z (deflection, -1 to 1).

    Notes
    -----
    l = 2 mm, t0 = 5 ms; |v| is smoothed within 0.1 mm/s, so that a holding contact does not creep.
    Source: after P. R. Dahl, A Solid Friction Model, 1968, with a cap on the rate.
    """
    size = soft_abs(s.speed, STILL)
    return (s.speed - size * s.bend) / (BEND + QUICKEST * size)


def bristle_sense(s: Signals) -> Number:
    """Sense of friction from a bristle, damped while it does not slide.

    s = z + t1 z' / (1 + (v / 0.1)^2)

    Parameters
    ----------
    s : bend z, bend_rate z' 1/s, speed v m/s, damping_time t1 s.

    Notes
    -----
    Without the damping a stopped car rocks on its bristles for a minute.
    Source: after Canudas de Wit et al., IEEE Trans. Autom. Control 40(3), 1995, doi:10.1109/9.376053.
    """
    return s.bend + s.damping_time * s.bend_rate / (1.0 + (s.speed * (1.0 / SLIDING)) ** 2)
