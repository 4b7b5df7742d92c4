from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on=("drive_torque_lead", "drive_torque_left_lead", "drive_torque_right_lead"),
    unknowns=Quantity("torque_delay", "s", "time by which the drive torque lags the other channels", "tau", -0.3, 0.3),
    reference="torque read from a vehicle's bus is 10 to 100 ms late",
    label="a drive torque with a wrong delay",
    signature="The real car responds to a torque step earlier than the simulated one, by a fixed time.",
    alike=("speed_delay", "backlash", "shaft_stiffness", "tire_relaxation"),
    confirm="Tap the throttle sharply a few times and compare the torque with an accelerometer.",
    tags={"sensor", "latency", "open_road"},
    covers=("speed_latency", "acceleration_latency"),
)
def torque_delay(lead: Law, s: Signals, q: Signals) -> Number:
    """A drive torque channel whose clock lags that of the other channels.

    T_read(t) = T(t - tau), tau in s, so that the torque on the car is the one logged tau later.
    """
    return lead(s) + q.torque_delay
