from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="inertial_clock",
    unknowns=Quantity(
        "acceleration_delay", "s", "time by which the acceleration lags the other channels", "tau", -0.1, 0.2
    ),
    reference="GPS receivers give their values 7 to 160 ms late; a filter of 10 Hz delays by some 20 ms",
    label="an acceleration that is logged late",
    signature="Where the acceleration changes, the residual is proportional to its time derivative.",
    alike=("clock_offset", "pitch_inertia"),
    confirm="Tap the brake sharply a few times and compare the acceleration with the wheel loads and the pitch rate.",
    sense="(below zero: wheel loads and pitch rate are late)",
    tags={"sensor", "latency", "pitching"},
)
def acceleration_delay(clock: Law, s: Signals, q: Signals) -> Number:
    """An acceleration by a slower device, or through a lower filter, than wheel loads and pitch rate.

    a_read(t) = a(t - tau), tau in s: its moment in the balance belongs to an earlier time.
    """
    return clock(s) + q.acceleration_delay
