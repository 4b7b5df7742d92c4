"""Transient slip of a tire (relaxation length), at speed and at rest, longitudinal and lateral."""

from __future__ import annotations

from vdyn_cli.engine.maths import soft_abs, sqrt
from vdyn_cli.engine.model_builder import Number, Signals

QUICKEST = 1e-3  # s, shortest time constant of the slip, for a fixed integration step
STILL = 1e-4  # m/s, speed below which slip does not decay
WIDEST = 2.0  # slip above which sliding does not deflect the tread further


def fresh_tread(s: Signals) -> Number:
    """Speed at which undeflected tread enters the contact patch, m/s.

    e = |v| + |vs| (s/2)^4

    For a rolling wheel it is the speed of the hub; the second term is then negligible (2e-5 of it at a slip of 0.2).
    For a wheel that spins at standstill the second term keeps the slip below 1.8, for rim speeds up to 200 m/s.

    Parameters
    ----------
    s : speed v m/s of the hub, sliding and sideways m/s (components of vs, of the tread over the road), slip and
        lateral_slip (components of s).

    Notes
    -----
    Both |.| are smoothed within 0.1 mm/s, so that a tire at rest keeps its deflection.
    """
    sliding = sqrt(s.sliding**2 + s.sideways**2 + STILL**2) - STILL
    return soft_abs(s.speed, STILL) + sliding * ((s.slip**2 + s.lateral_slip**2) * (1.0 / WIDEST**2)) ** 2


def slip_rate(s: Signals) -> Number:
    """Rate of the slip, 1/s: sliding deflects the tread, fresh tread replaces it.

    s' = (vs - e s) / sqrt(sigma^2 + (t0 e)^2)

    Steady at s = vs/|v|. At rest s' = vs/sigma: the tread is a spring that holds.

    Parameters
    ----------
    s : sliding vs m/s (of the tread over the road, against the force), fresh e m/s (see ``fresh_tread``), slip,
        relaxation_length sigma m.

    Notes
    -----
    t0 = 1 ms keeps a fixed step stable; at 30 m/s it adds 0.7 % to a relaxation length of 0.25 m.
    Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed., 2012, section 7.2, with the standstill's terms added.
    """
    return (s.sliding - s.fresh * s.slip) / sqrt(s.relaxation_length**2 + (QUICKEST * s.fresh) ** 2)


def damped_slip(s: Signals) -> Number:
    """Slip with the damping of the tread near rest.

    s + c/k vs / (1 + v^4)

    Parameters
    ----------
    s : slip, sliding vs m/s, speed v m/s, stiffness k (of the force over the slip, per peak friction and load),
        tire_rest_damping c s/m.

    Notes
    -----
    Without it a stopped car rocks on its tires forever. Above 5 m/s it is negligible. It does not increase with the
    tire's stiffness, so that a light wheel remains stable with fixed steps of 1 ms.
    """
    return s.slip + s.sliding * (s.tire_rest_damping / s.stiffness / (1.0 + s.speed**4))
