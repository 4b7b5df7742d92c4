from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="driven_clock",
    unknowns=Quantity("hub_torque_delay", "s", "delay of the hub's torque behind its forces", "tau", -0.2, 0.2),
    reference="torque from a bus or a filtered slip ring beside forces from another amplifier: 5 to 50 ms",
    label="a hub torque that is logged late",
    signature="The torque residual is proportional to the time derivative of the torque: loops over the torque.",
    alike=("clock_offset", "hub_torque_lag"),
    confirm="Hit the standing car's tire once with all channels logged, and compare the times of torque and forces.",
    sense="(below zero: the forces are late)",
    tags={"sensor", "latency", "rolling_wheel_spin"},
)
def hub_torque_delay(clock: Law, s: Signals, q: Signals) -> Number:
    """A torque at the hub that is logged later than the forces: T_read(t) = T(t - tau), tau in s.

    Where torque and forces are late alike, that is a clock offset of the wheel's speed and the acceleration.
    """
    return clock(s) + q.hub_torque_delay
