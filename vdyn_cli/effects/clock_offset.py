from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


def early(clock: Law, s: Signals, q: Signals) -> Number:
    """Clock of an output that is computed from late channels: it belongs to an earlier time."""
    return clock(s) + q.clock_offset


@effect(
    on=("vertical_acceleration_clock", "pitch_rate_clock", "wheel_height_front_clock", "wheel_height_rear_clock"),
    also={"loads_clock": early, "hub_clock": early, "driven_clock": early},
    unknowns=Quantity("clock_offset", "s", "delay of some channels relative to the others", "tau", -0.2, 0.2),
    reference="latency of inertial and GPS devices: 7 to 160 ms; devices without a common trigger: a sample or more",
    label="a delay of some channels relative to the others",
    signature="The residual is proportional to the time derivative of the late channels (loops in plots of "
    "residual over channel).",
    alike=("tire_damping", "tire_relaxation", "pitch inertia"),
    confirm="Hit the car once at rest while all channels are logged, and compare the time of the response in each.",
    sense="(late: loads, torque and forces; on a bump the body's motion; in a drop the wheels' heights)",
    tags={"sensor", "latency", "bump_crossing", "pitching", "wheel_spin"},
)
def clock_offset(clock: Law, s: Signals, q: Signals) -> Number:
    """Channels of one device that are logged late relative to those of another.

    x_read(t) = x(t - tau), tau in s. On a bump the late channels are the body's acceleration and pitch rate; in a drop
    the heights of the wheels; in runs for the center of gravity the wheel loads; at a wheel the hub's torque and
    forces.
    """
    return clock(s) - q.clock_offset
