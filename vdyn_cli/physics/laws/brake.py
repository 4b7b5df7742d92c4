"""The brakes' force on the road."""

from __future__ import annotations

from vdyn_cli.engine.model_builder import Number, Signals


def brake(s: Signals) -> Number:
    """Brake force at the tire contact, N, against the motion.

    Parameters
    ----------
    s : brake_force N (0 without braking: dragging pads are an effect on this law), speed m/s, sense (-1 to 1, see
        ``standstill``), share (of all the vehicle's brakes that this call stands for).
    """
    return s.brake_force * s.sense
