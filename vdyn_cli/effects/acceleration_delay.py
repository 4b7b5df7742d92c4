from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


def late(clock: Law, s: Signals, q: Signals) -> Number:
    """Clock of a simulated acceleration: the sensor shows that of an earlier time."""
    return clock(s) - q.acceleration_delay


@effect(
    on="inertial_clock",
    also={"acceleration_clock": late},
    unknowns=Quantity(
        "acceleration_delay", "s", "time by which the acceleration lags the other channels", "tau", -0.1, 0.2
    ),
    reference="GPS receivers give their values 7 to 160 ms late; a filter of 10 Hz delays by some 20 ms",
    label="an acceleration that is logged late",
    signature="Where the acceleration changes, the residual is proportional to its time derivative.",
    alike=("clock_offset", "pitch_inertia", "torque_delay", "speed_delay"),
    confirm="Tap the brake sharply a few times and compare the acceleration with the other channels.",
    sense="(below zero: the other channels are late)",
    tags={"sensor", "latency", "pitching", "driving"},
    covers=("acceleration_latency",),
)
def acceleration_delay(clock: Law, s: Signals, q: Signals) -> Number:
    """An acceleration by a slower device, or through a lower filter, than the other channels.

    a_read(t) = a(t - tau), tau in s: where the balance of the wheel loads is computed from the measured acceleration,
    its moment belongs to an earlier time.
    """
    return clock(s) + q.acceleration_delay
