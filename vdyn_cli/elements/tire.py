"""Longitudinal force of a tyre over its slip."""

from __future__ import annotations

from vdyn_cli.engine.bench import Number, Signals
from vdyn_cli.engine.maths import atan, sin


def tire(s: Signals) -> Number:
    """Longitudinal force by the magic formula.

    F = Fz D sin(C atan(B s - E (B s - atan(B s)))), s = om r / V - 1.

    Signals: ``load`` Fz, N; ``slip`` s, fraction; ``tire_B``, ``tire_C``, ``tire_D``, ``tire_E``. Returns N, positive
    when it drives the car. Pure longitudinal slip in steady state, friction independent of load.

    Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed., 2012, section 4.3.1; slip after SAE J670.
    """
    b = s.tire_B * s.slip
    return s.load * s.tire_D * sin(s.tire_C * atan(b - s.tire_E * (b - atan(b))))
