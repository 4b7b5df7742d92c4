"""Rolling resistance of the tires."""

from __future__ import annotations

from vdyn_cli.engine.model_builder import Number, Signals


def rolling(s: Signals) -> Number:
    """Rolling resistance, N, against the motion.

    Rr = (frr + frr1 V) Fz s

    Parameters
    ----------
    s : rolling_resistance, rolling_speed s/m (frr1), load N (Fz between tires and road; M g cos(grade) for all of
        them), speed m/s, sense s (-1 to 1, see ``standstill_friction``), share (of the vehicle's tires that this call
        represents).

    Notes
    -----
    Assumes tires at one temperature and pressure.
    Source: doi:10.4271/2017-01-1574, equation (4); linear term after SAE J2452's shortened form.
    """
    return (s.rolling_resistance + s.rolling_speed * s.speed) * s.load * s.sense
