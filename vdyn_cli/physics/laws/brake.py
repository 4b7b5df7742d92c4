"""Brake force at the tire contacts."""

from __future__ import annotations

from vdyn_cli.engine.model_builder import Number, Signals


def brake(s: Signals) -> Number:
    """Brake force at the tire contact, N, against the motion.

    F = Fb s

    Parameters
    ----------
    s : brake_force Fb in N (0 without braking: dragging pads are an effect on this law), speed m/s, sense s (-1 to 1,
        see ``standstill_friction``), share (of the vehicle's brakes that this call represents).
    """
    return s.brake_force * s.sense
