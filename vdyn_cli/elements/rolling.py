"""The tires' rolling resistance."""

from __future__ import annotations

from vdyn_cli.engine.bench import Number, Signals
from vdyn_cli.engine.maths import GRAVITY, sqrt, tanh

STANDSTILL = 0.05  # m/s, over which resistance turns with the direction of motion; exactly 1 above 1 m/s


def rolling(s: Signals) -> Number:
    """Rolling resistance, N, against the motion.

    Rr = (frr + frr1 V) M g cos(grade) sgn(V), with the sign made smooth over 0.05 m/s

    Parameters
    ----------
    s : rolling_resistance, rolling_speed s/m (frr1), mass kg, grade (rise over run), speed m/s.

    Notes
    -----
    Assumes tires at one temperature and pressure.
    Source: doi:10.4271/2017-01-1574, equation (4); linear term after SAE J2452's shortened form.
    """
    normal = s.mass * GRAVITY / sqrt(1.0 + s.grade**2)
    return (s.rolling_resistance + s.rolling_speed * s.speed) * normal * tanh(s.speed / STANDSTILL)
