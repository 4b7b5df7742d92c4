from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="slip",
    unknowns=Quantity("slip_lag", "s", "delay of the force behind the logged slip", "tau", -0.1, 0.1),
    reference="filters and telemetry of a wheel's forces: 2 to 50 ms; a relaxation length of 0.3 m at 10 m/s is 30 ms",
    label="a time lag between slip and force",
    signature="Force over slip is a loop: increasing and decreasing slip give different forces.",
    alike=("tire_relaxation",),
    confirm="Log the speed and sweep at a third of it: the delay of a channel stays the same, that of a "
    "relaxation length is three times as long.",
    sense="(negative: the slip is logged late)",
    tags={"test_only", "slip_sweep"},
)
def slip_lag(slip: Law, s: Signals, q: Signals) -> Number:
    """A force that is logged later than the slip, or builds up later, by a constant time.

    F(t) = F(s(t - tau)), to first order about the lag found before, F the force, N, and s the slip. Sweeps at different
    speeds separate it from a relaxation length, which is a lag in distance.
    """
    return slip(s) - q.slip_lag * s.slip_rate
