"""Rolling resistance of the tires."""

from __future__ import annotations

from vdyn_cli.engine.model_builder import Number, Signals


def rolling(s: Signals) -> Number:
    """Rolling resistance, N, against the motion.

    Rr = (frr + frr1 V) Fz sgn(V)

    Parameters
    ----------
    s : rolling_resistance, rolling_speed s/m (frr1), load N (Fz between tires and road; M g cos(grade) for all of
        them), speed m/s (V), sense (-1 to 1, in place of sgn(V), see ``standstill_friction``).

    Notes
    -----
    Assumes tires at one temperature and pressure.
    Source: doi:10.4271/2017-01-1574, equation (4); linear term: b V of SAE J2452's P^a Z^b (a + b V + c V^2).
    """
    return (s.rolling_resistance + s.rolling_speed * s.speed) * s.load * s.sense
