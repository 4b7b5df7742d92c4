"""Aerodynamic drag of the vehicle."""

from __future__ import annotations

from vdyn_cli.engine.maths import fabs
from vdyn_cli.engine.model_builder import Number, Signals


def air(s: Signals) -> Number:
    """Air drag, N, against forward motion.

    Fd = 1/2 rho Cd A (V + w) |V + w|

    Parameters
    ----------
    s : air_density kg/m^3, drag_area m^2 (Cd A), speed m/s, wind m/s (headwind, positive against motion).

    Notes
    -----
    Assumes that Cd does not change with speed or with the angle of the flow; a crosswind is not included.
    Source: doi:10.4271/2017-01-1574, equation (2).
    """
    flow = s.speed + s.wind
    return 0.5 * s.air_density * s.drag_area * flow * fabs(flow)


def gust_drag(s: Signals) -> Number:
    """Increase of the mean drag by gusts, N: drag is quadratic, so a wind of zero mean does not average out.

    E[1/2 rho Cd A (V + w)^2] = 1/2 rho Cd A (V^2 + var w)

    Parameters
    ----------
    s : air_density kg/m^3, drag_area m^2, wind_variance m^2/s^2 (along the track).

    Notes
    -----
    Holds while V + w does not change sign.
    """
    return 0.5 * s.air_density * s.drag_area * s.wind_variance
