"""Moments about the rear contact, of the axle loads and of the vehicle's motion."""

from __future__ import annotations

from vdyn_cli.engine.model_builder import Number, Signals
from vdyn_cli.quantities.constants import GRAVITY


def load_moment(s: Signals) -> Number:
    """Moment of the axles' forces on the body about the rear axle, less that of the body's weight, N m, nose-up.

    L Bf - ls (Bf + Br),   B = F - m (g + z''),   ls = (M lr - mf L) / (M - mf - mr)

    The axles, of masses mf and mr, move vertically on the tires (z'' upward), and the body's center lies ls ahead of
    the rear axle. Without unsprung masses this is L Ff - lr (Ff + Fr). With both axle loads measured it does not depend
    on the body's heave.

    Signals: ``front_load``, ``rear_load`` N, upward forces of the road on each axle; ``front_axle_acceleration``,
    ``rear_axle_acceleration`` m/s^2; ``mass``, ``unsprung_front``, ``unsprung_rear`` kg; ``wheelbase``, ``cg_to_rear``.
    """
    front = s.front_load - s.unsprung_front * (GRAVITY + s.front_axle_acceleration)
    rear = s.rear_load - s.unsprung_rear * (GRAVITY + s.rear_axle_acceleration)
    sprung_mass = s.mass - s.unsprung_front - s.unsprung_rear
    to_rear = (s.mass * s.cg_to_rear - s.unsprung_front * s.wheelbase) / sprung_mass
    return s.wheelbase * front - to_rear * (front + rear)


def motion_moment(s: Signals) -> Number:
    """Moment of drive, brakes, slope and drag minus the inertial moment, about the rear contact, N m, nose-up.

    M h a + J (a + vs') + h W + Fd hd - I th'' + M g e th,   a = a_antenna + (H - h) th'' + d th'^2

    J = sum of the wheels' inertia over their radius: accelerating wheels reduce the load of the front axle as if the
    center of gravity were higher by J/M (some 10 mm for a car). Where the force changes, the wheels accelerate by vs'
    more than the car, the rate of the sliding speed vs of their tires.

    The body turns about an axis e below its center of gravity, which therefore moves to the rear by e th.

    Signals: ``acceleration`` m/s^2 of the antenna, free of gravity; ``pitch`` rad, ``pitch_rate``,
    ``pitch_acceleration`` nose-up, rad/s, rad/s^2; ``climb`` N, the weight along the road (W), positive uphill;
    ``drag`` N at ``drag_height`` m; ``mass``, ``cg_height``, ``pitch_inertia``, ``antenna_height``,
    ``antenna_offset`` (ahead of the center of gravity), ``spin`` kg m (J), ``sliding_rate`` m/s^2 (vs'),
    ``pitch_axis`` m (e).

    Assumes a rigid body; source: SAE 2017-01-1574, equations (5) to (7), with the wheels' inertia added.
    """
    lever = s.antenna_height - s.cg_height
    acceleration = s.acceleration + lever * s.pitch_acceleration + s.antenna_offset * s.pitch_rate**2
    return (
        (s.mass * s.cg_height + s.spin) * acceleration
        + s.spin * s.sliding_rate
        + s.cg_height * s.climb
        + s.drag * s.drag_height
        - s.pitch_inertia * s.pitch_acceleration
        + s.mass * GRAVITY * s.pitch_axis * s.pitch
    )
