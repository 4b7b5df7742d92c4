"""Longitudinal and lateral force of a tire as functions of its slip."""

from __future__ import annotations

from vdyn_cli.engine.maths import atan, fmax, sin, sqrt
from vdyn_cli.engine.model_builder import Number, Signals


def tire(s: Signals) -> Number:
    """Longitudinal force by the magic formula.

    F = Fz D (sin(C atan(B s - E (B s - atan(B s)))) + d), s = om r / V - 1

    with om r the rim's speed and V the hub's, m/s. Signals: ``load`` Fz, N; ``slip`` s, fraction; ``tire_B``,
    ``tire_C``, ``tire_D``, ``tire_E``, without unit; ``departure`` d from the formula, 0 where it is not given. Returns
    N, positive when it drives the car. Assumes pure longitudinal slip in steady state, friction independent of load.

    Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed., 2012, section 4.3.1; slip after SAE J670.
    """
    b = s.tire_B * s.slip
    formula = sin(s.tire_C * atan(b - s.tire_E * (b - atan(b))))
    return s.load * s.tire_D * (formula + s.__dict__.get("departure", 0.0))


def friction(s: Signals) -> Number:
    """Peak friction, which decreases with the load.

    D (1 - k (Fz - F0)), never below zero

    Signals: ``load`` Fz and ``static_load`` F0 (at which D was measured), N; ``tire_D`` D; ``tire_load_sensitivity`` k,
    1/N. Source: the linear term of Pacejka, Tire and Vehicle Dynamics, 3rd ed., 2012, section 4.3.2.
    """
    return s.tire_D * fmax(1.0 - s.tire_load_sensitivity * (s.load - s.static_load), 0.0)


def cornering(s: Signals) -> Number:
    """Lateral force of a wheel that is not steered.

    Fy = Fz D c a / sqrt(D^2 + (c a)^2)

    Signals: ``load`` Fz, N; ``slip`` a, lateral sliding over forward speed (the tangent of the slip angle), with the
    sign of the force; ``tire_cornering_stiffness`` c, per load, 1/rad; ``tire_D`` D. Returns N. An empirical saturating
    line, sufficient for straight driving, where lateral slip is only a disturbance.
    """
    line = s.tire_cornering_stiffness * s.slip
    return s.load * s.tire_D * line / sqrt(s.tire_D**2 + line**2)
