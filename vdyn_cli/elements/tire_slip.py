"""How a tyre's slip builds up, at speed and at rest."""

from __future__ import annotations

from vdyn_cli.engine.bench import Number, Signals
from vdyn_cli.engine.maths import soft_abs, sqrt

QUICKEST = 1e-3  # s, no slip changes faster, so that a fixed step can follow it
TREAD_DAMPING = 0.08  # s/m, slip per sliding speed
STILL = 1e-4  # m/s, below which slip does not leak away
WIDEST = 2.0  # slip beyond which sliding winds the tread up no further


def passing(speed: Number) -> Number:
    """How fast a tread passes the contact, m/s, from a speed of either sign: |v|, soft within 0.1 mm/s."""
    return soft_abs(speed, STILL)


def slip_rate(s: Signals) -> Number:
    """Rate of the slip, 1/s: sliding bends the tread, fresh tread that rolls in takes the bend away.

    s' = (vs - e s) / sqrt(sigma^2 + (t0 e)^2),   e = |v| + |vs| (s/2)^4

    Steady at s = vs/|v|. At rest s' = vs/sigma: the tread is a spring that holds. In a spin at rest the last term keeps
    the slip below 1.8; at a slip of 0.2 it is 1e-5 of the first.

    Parameters
    ----------
    s : sliding vs m/s (of the rim over the road, in the sense in which the force will act), passing |v| m/s (the speed
        at which fresh tread comes in), slip, relaxation_length sigma m.

    Notes
    -----
    t0 = 1 ms keeps a fixed step stable; at 30 m/s it adds 0.7 % to a relaxation length of 0.25 m.
    Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed., 2012, section 7.2, with the standstill's terms added.
    """
    fresh = s.passing + passing(s.sliding) * (s.slip / WIDEST) ** 4
    return (s.sliding - fresh * s.slip) / sqrt(s.relaxation_length**2 + (QUICKEST * fresh) ** 2)


def damped_slip(s: Signals) -> Number:
    """The slip that the tread's rubber answers to: near rest it also damps.

    s + c vs / (1 + v^4),   c = 0.08 s/m

    Parameters
    ----------
    s : slip, sliding vs m/s, speed v m/s.

    Notes
    -----
    Without it a car that has stopped rocks on its tires for ever. Above 5 m/s nothing is left of it.
    """
    return s.slip + TREAD_DAMPING * s.sliding / (1.0 + s.speed**4)
