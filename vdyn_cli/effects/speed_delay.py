from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="speed_clock",
    unknowns=Quantity("speed_delay", "s", "time by which the speed channel lags the others", "tau", -0.3, 0.5),
    reference="GPS receivers give their speed 7 to 160 ms late",
    label="a speed channel with a wrong delay",
    signature="Where the acceleration changes, the measured speed lags the simulated one by a fixed time.",
    alike=("torque_delay", "tire_relaxation", "shaft_stiffness"),
    confirm="Tap the throttle or the brake sharply a few times and compare the speed with an accelerometer.",
    tags={"sensor", "latency", "open_road"},
    covers=("speed_latency",),
)
def speed_delay(clock: Law, s: Signals, q: Signals) -> Number:
    """A speed channel whose clock lags that of the other channels.

    V_read(t) = V(t - tau), tau in s. In coasts alone it is collinear with the start speed.
    """
    return clock(s) - q.speed_delay
