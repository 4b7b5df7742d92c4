"""Equations of motion of a wheel as a compound, bifilar or torsional pendulum.

Each law gives the angular acceleration, rad/s^2, from ``angle`` (rad from rest), ``rate`` (rad/s), ``stiffness``
(w^2, the square of the angular frequency of small oscillations, 1/s^2) and ``slowing`` (rad/s^2). J is the moment of
inertia about the center of mass, kg m^2, and m the mass, kg. Source: Lagrange's equation of a rigid body.
"""

from __future__ import annotations

from vdyn_cli.engine.maths import cos, fabs, sin, sqrt
from vdyn_cli.engine.model_builder import Number, Signals

TURNING = 0.01  # rad/s, over which dry friction changes its sign


def slowing(s: Signals) -> Number:
    """Deceleration by friction, rad/s^2: (2 D + q |phi'|) phi' + f phi' / sqrt(phi'^2 + 0.01^2).

    ``damping`` D (1/s) is viscous, ``drag`` q (1/rad) the air's, ``friction`` f (rad/s^2) dry.
    """
    return (2 * s.damping + s.drag * fabs(s.rate) + s.friction / sqrt(s.rate**2 + TURNING**2)) * s.rate


def compound(s: Signals) -> Number:
    """A body on a pivot at a distance d (m): phi'' = -w^2 sin(phi) - slowing, w^2 = m g d / (J + m d^2)."""
    return -s.stiffness * sin(s.angle) - s.slowing


def torsional(s: Signals) -> Number:
    """A body on a rod of stiffness kt (N m/rad): phi'' = -w^2 phi - slowing, w^2 = kt / J, at any amplitude."""
    return -s.stiffness * s.angle - s.slowing


def bifilar(s: Signals) -> Number:
    """A body on two parallel cords, turning about the vertical while it rises.

    Cords of length l (m) at half spacing b (m) have the vertical extent z(phi) = sqrt(l^2 - 2 b^2 (1 - cos phi)); the
    body rises by l - z with slope z1 = b^2 sin(phi) / z. Lagrange's equation, divided by J, with m/J = w^2 l / (g b^2):

        phi'' (1 + m/J z1^2) = -m/J z1 (g + z2 phi'^2) - slowing
        z2 = d z1 / d phi = (b^2 cos(phi) + z1^2) / z

    Small oscillations: w^2 = m g b^2 / (J l). Assumes inextensible cords without mass, a level body, no swaying.
    """
    b2 = s.half_spacing**2
    height = sqrt(s.cord_length**2 - 2 * b2 * (1 - cos(s.angle)))
    slope = b2 * sin(s.angle) / height
    bend = (b2 * cos(s.angle) + slope**2) / height
    ratio = s.stiffness * s.cord_length / (s.gravity * b2)
    push = ratio * slope * (s.gravity + bend * s.rate**2) + s.slowing
    return -push / (1 + ratio * slope**2)
