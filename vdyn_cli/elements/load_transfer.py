"""The moments about the rear axle's contact that load the front axle."""

from __future__ import annotations

from vdyn_cli.engine.bench import Number, Signals


def load_transfer(s: Signals) -> Number:
    """Moment balance of the whole car about the rear contact, N m; zero where loads and motion agree.

    L Ff - lr (Ff + Fr) + (M h + J) a + Fd hd - I th'',   a = a_antenna + (H - h) th'' + d th'^2

    J = sum of the wheels' inertia over their radius: wheels that spin up take load off the front axle as if the centre
    of gravity were higher by J/M (some 10 mm for a car). With both axles' loads measured the body's heave drops out.

    Signals: ``front_load``, ``rear_load`` N; ``acceleration`` m/s^2 of the antenna, free of gravity;
    ``pitch_rate``, ``pitch_acceleration`` nose-up, rad/s, rad/s^2; ``drag`` N at ``drag_height`` m; ``mass``,
    ``wheelbase``, ``cg_to_rear``, ``cg_height``, ``pitch_inertia``, ``antenna_height``, ``antenna_offset`` (ahead of
    the centre of gravity), ``spin`` kg m (J).

    Assumes a flat road and a body that pitches as one; source: SAE 2017-01-1574, equations (5) to (7), with the
    wheels' spin and the rear load added.
    """
    lever = s.antenna_height - s.cg_height
    acceleration = s.acceleration + lever * s.pitch_acceleration + s.antenna_offset * s.pitch_rate**2
    return (
        s.wheelbase * s.front_load
        - s.cg_to_rear * (s.front_load + s.rear_load)
        + (s.mass * s.cg_height + s.spin) * acceleration
        + s.drag * s.drag_height
        - s.pitch_inertia * s.pitch_acceleration
    )
