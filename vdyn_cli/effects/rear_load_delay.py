from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="rear_load_clock",
    unknowns=Quantity("rear_load_delay", "s", "delay of the rear loads relative to the front loads", "tau", -0.2, 0.2),
    reference="latency of telemetry from a wheel: 1 to 20 ms; loggers without a common trigger: a sample or more",
    label="rear wheel loads that are logged late",
    signature="The residual of the rear load is proportional to that load's time derivative, equally at every speed.",
    alike=("clock_offset", "bump_width_error", "speed_error"),
    confirm="Push the parked car down at its middle and release it while all loads are logged, and compare the times.",
    sense="(below zero: the front loads and the body's motion are late)",
    tags={"sensor", "latency", "bump_crossing"},
)
def rear_load_delay(clock: Law, s: Signals, q: Signals) -> Number:
    """Loads of the rear axle that are logged late relative to the other channels: F_read(t) = F(t - tau).

    tau in s. Where only loads are logged, early front loads look the same.
    """
    return clock(s) - q.rear_load_delay
