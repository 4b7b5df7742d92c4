"""A wheel as compound, bifilar or torsional pendulum, and its moment of inertia from the period."""

from __future__ import annotations

from math import cos, pi

from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import Law, ModelBuilder, Signals
from vdyn_cli.physics.laws.pendulum_motion import bifilar, compound, slowing, torsional

_OWN = ("period", "damping", "drag", "friction", "angle_zero", "rate_zero")


def _swinging(law: Law, *geometry: str) -> Model:
    """The model of one kind of pendulum: states angle and rate, each with a sensor."""

    def assemble(e: ModelBuilder, u: Signals) -> None:
        p = e.p
        angle, rate = e.state("angle"), e.state("angular_rate")
        given = {name: getattr(p, name) for name in geometry}
        stiffness = (2 * pi / p.period) ** 2
        slowed = e(slowing, rate=rate, damping=p.damping, drag=p.drag, friction=p.friction)
        turning = e(law, angle=angle, rate=rate, stiffness=stiffness, slowing=slowed, **given)
        e.integrate(angle=rate, angular_rate=turning)
        e.sensor("angle", angle + p.angle_zero, rate)
        e.sensor("angular_rate", rate + p.rate_zero, turning)

    return Model(f"{law.__name__} pendulum", assemble, (*_OWN, *geometry), ())


MODELS = {
    "compound": _swinging(compound),
    "bifilar": _swinging(bifilar, "half_spacing", "cord_length", "gravity"),
    "torsional": _swinging(torsional),
}


def compound_inertia(period: float, mass: float, pivot_distance: float, gravity: float) -> float:
    """Moment of inertia about the center of mass, kg m^2, of a body swinging about a pivot.

    J = m g d T^2 / (4 pi^2) - m d^2

    with d (m) from pivot to center of mass, m (kg), g ``gravity`` (m/s^2), T (s) the period of small oscillations.
    """
    return mass * pivot_distance * (gravity * (period / (2 * pi)) ** 2 - pivot_distance)


def bifilar_inertia(period: float, mass: float, separation: float, length: float, gravity: float) -> float:
    """Moment of inertia about the vertical axis, kg m^2, of a body on two parallel cords.

    J = m g b^2 T^2 / (4 pi^2 l)

    with b half the separation of the cords and l their length (m), m (kg), g ``gravity`` (m/s^2), T (s) the period of
    small oscillations. Assumes the axis midway between the cords.
    """
    return mass * gravity * (separation / 2) ** 2 / length * (period / (2 * pi)) ** 2


def torsional_inertia(period: float, torsional_stiffness: float) -> float:
    """Moment of inertia about the rod, kg m^2: J = kt T^2 / (4 pi^2), kt in N m/rad, T the period in s."""
    return torsional_stiffness * (period / (2 * pi)) ** 2


def bar_inertia(mass: float, length: float, diameter: float) -> float:
    """Moment of inertia of a solid round bar about a diameter of its middle, kg m^2: m (L^2 / 12 + D^2 / 16), kg, m."""
    return mass * (length**2 / 12 + diameter**2 / 16)


def small_swing(
    kind: str, period: float, amplitude: float, separation: float = 0.0, length: float = 1.0, gravity: float = 1.0
) -> float:
    """The period T0 of small oscillations, s, from the period T (s) at an amplitude a (rad).

    compound    T0 = T agm(1, cos(a/2)), exact; about T / (1 + a^2/16)
    bifilar     T0 = T agm(1, cos(a/2)) / (1 + a^2 (w^2 b^2/(4 g l) - 3 b^2/(16 l^2))), to order a^2, including the
                energy of the body's rise and the decreasing vertical extent of the cords
    torsional   T0 = T

    with agm the arithmetic-geometric mean, w = 2 pi / T, and of the bifilar kind b half the separation of the cords,
    l their length (m), g gravity (m/s^2). Source: C. F. Gauss's solution of the complete elliptic integral.
    """
    if kind == "torsional":
        return period
    sine = period * _agm(1.0, cos(amplitude / 2))
    if kind == "compound":
        return sine
    half = separation / 2
    rise = (2 * pi / period) ** 2 * half**2 / (4 * gravity * length) - 3 * (half / length) ** 2 / 16
    return sine / (1 + amplitude**2 * rise)


def _agm(a: float, b: float) -> float:
    while abs(a - b) > 1e-15 * abs(a):
        a, b = (a + b) / 2, (a * b) ** 0.5
    return a
