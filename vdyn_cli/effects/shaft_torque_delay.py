from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on=("shaft_torque_left_clock", "shaft_torque_right_clock"),
    unknowns=Quantity(
        "shaft_torque_delay", "s", "time by which the shaft torques lag the other channels", "tau", -0.3, 0.3
    ),
    reference="telemetry of strain gauges: 1 to 20 ms; channels of a vehicle's bus beside it are 10 to 100 ms late",
    label="shaft torques with a wrong delay",
    signature="Where the torque changes, the residual of both shafts is proportional to the torque's rate.",
    alike=("torque_delay", "shaft_damping", "shaft_stiffness"),
    confirm="Tap the throttle sharply a few times and compare the shaft torques with an accelerometer.",
    sense="(below zero: the other channels are late)",
    tags={"sensor", "latency", "driving"},
)
def shaft_torque_delay(clock: Law, s: Signals, q: Signals) -> Number:
    """Torques of the half-shafts by a device whose clock lags that of the other channels.

    T_read(t) = T(t - tau), tau in s. A bus beside a fast amplifier is late as a whole: the shaft torques are early.
    """
    return clock(s) - q.shaft_torque_delay
