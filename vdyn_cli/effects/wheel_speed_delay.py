from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on=("wheel_speed_fl_clock", "wheel_speed_fr_clock", "wheel_speed_rl_clock", "wheel_speed_rr_clock"),
    unknowns=Quantity(
        "wheel_speed_delay", "s", "time by which the wheel speeds lag the other channels", "tau", -0.2, 0.3
    ),
    reference="wheel speeds of a brake control unit are sent every 10 to 20 ms, filtered over several teeth",
    label="wheel speeds that are logged late",
    signature="Where a wheel's speed changes, its residual is proportional to its rate, on all wheels alike.",
    alike=("speed_delay", "torque_delay", "tire_relaxation", "slip_stiffness"),
    confirm="Tap the brake sharply a few times and compare the wheel speeds with an accelerometer.",
    tags={"sensor", "latency", "driving"},
)
def wheel_speed_delay(clock: Law, s: Signals, q: Signals) -> Number:
    """Wheel speeds of one control unit whose clock lags that of the other channels.

    w_read(t) = w(t - tau), tau in s.
    """
    return clock(s) - q.wheel_speed_delay
