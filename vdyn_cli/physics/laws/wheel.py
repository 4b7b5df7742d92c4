"""Moment balance of a wheel about its axle."""

from __future__ import annotations

from vdyn_cli.engine.model_builder import Number, Signals
from vdyn_cli.quantities.constants import GRAVITY


def bearing(s: Signals) -> Number:
    """Friction torque outboard of the wheel force sensor, N m: T = Tb, zero in the baseline.

    Signals: ``bearing_torque`` Tb, N m. Assumed constant, Coulomb friction of a wheel that always rolls forward.
    """
    return s.bearing_torque


def bearing_drag_torque(s: Signals) -> Number:
    """Drag torque of a wheel's bearing, seals and pads, N m: T = sense (Tb + cb |om|).

    Signals: ``bearing_torque`` Tb at standstill, N m; ``bearing_viscous`` cb, N m s/rad; ``wheel_speed`` om, rad/s;
    ``sense`` -1 to 1, direction of rotation. Windage, a torque proportional to om^2, is not included. Source: Coulomb
    and viscous friction, Armstrong-Helouvry et al., Automatica 30 (1994) 1083.
    """
    return s.bearing_torque * s.sense + s.bearing_viscous * s.wheel_speed


def free_wheel_spin(s: Signals) -> Number:
    """Angular acceleration of a free wheel, rad/s^2: J om' = T - Tb.

    Signals: ``hub_torque`` T and ``bearing_torque`` Tb, N m; ``wheel_inertia`` J, kg m^2, of all rotating parts; om is
    the wheel's speed, rad/s.
    """
    return (s.hub_torque - s.bearing_torque) / s.wheel_inertia


def wheel_spin(s: Signals) -> Number:
    """Angular acceleration of a wheel between its hub and the road, rad/s^2.

    Jw om' = T - Tb - (Fx + mw a) r - frr (Fz + mw g) r

    with om the wheel's speed (rad/s), Jw its moment of inertia (kg m^2), T the hub torque and Fx, Fz the hub forces
    (N m, N), Tb the bearing's friction torque (N m), frr the rolling resistance, g gravity, a the specific force along
    the road (which includes the slope), mw the mass and r (m) the radius between hub and road. Assumes one radius for
    both levers and a rolling wheel. Source: the wheel's moment balance, equations (19)-(22) of
    doi:10.4271/2017-01-1574.
    """
    ground = s.hub_force_x + s.wheel_mass * s.acceleration
    load = s.hub_force_z + s.wheel_mass * GRAVITY
    torque = s.hub_torque - s.bearing_torque - (ground + s.rolling_resistance * load) * s.wheel_radius
    return torque / s.wheel_inertia


def read_gain(s: Signals) -> Number:
    """Gain of a speed that was computed from a wheel's by a radius that may be wrong, dimensionless.

    V_read / V = r0 / r

    Parameters
    ----------
    s : wheel_radius r in m, and the radius r0 (read_radius) of the computation in m.
    """
    return s.read_radius / s.wheel_radius
