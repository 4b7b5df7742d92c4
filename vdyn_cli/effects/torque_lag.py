from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on=("drive_torque_lag", "drive_torque_left_lag", "drive_torque_right_lag"),
    unknowns=Quantity(
        "torque_lag", "s", "time constant with which the torque follows the logged one", "tau", -0.1, 0.4
    ),
    reference="a commanded torque: motors follow with 5 to 50 ms, engines with 50 to 300 ms (Kiencke, Nielsen, "
    "Automotive Control Systems, 2nd ed. 2005, ch. 4 and 5); filters of bus signals: 5 to 100 ms",
    label="a drive torque with an unmodeled first-order lag",
    signature="The real car responds to a torque step gradually: at once, but with an exponential tail.",
    alike=("torque_delay", "speed_delay", "shaft_stiffness", "tire_relaxation"),
    confirm="Step the torque abruptly: a delay moves the whole response, a lag only rounds it.",
    sense="(below zero: the channel lags the torque)",
    tags={"sensor", "latency", "open_road"},
    covers=("speed_latency", "acceleration_latency"),
)
def torque_lag(lag: Law, s: Signals, q: Signals) -> Number:
    """A drive torque channel logged before a first-order lag (a command), or behind one (a filtered signal).

    tau T' + T = T_read, N m; for tau < 0 T = T_read - tau T_read'.
    """
    return lag(s) + q.torque_lag
