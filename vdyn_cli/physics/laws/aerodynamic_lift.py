"""Lift of the body in the air."""

from __future__ import annotations

from vdyn_cli.engine.maths import fabs
from vdyn_cli.engine.model_builder import Number, Signals


def lift(s: Signals) -> Number:
    """Aerodynamic lift, N, upward: the reduction of the axle loads at speed.

    Fl = 1/2 rho Cl A (V + w) |V + w|

    Parameters
    ----------
    s : air_density kg/m^3, lift_area m^2 (Cl A) at one axle, ``rear`` 1 at the rear axle and 0 at the front one,
        speed m/s, wind m/s (against the vehicle).

    Notes
    -----
    Assumes that Cl does not change with speed or ride height. Source: J. Y. Wong, Theory of Ground Vehicles, 4th ed.,
    2008, section 3.2.
    """
    flow = s.speed + s.wind
    return 0.5 * s.air_density * s.lift_area * flow * fabs(flow)
