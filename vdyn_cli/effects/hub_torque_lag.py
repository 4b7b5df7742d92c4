from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="driven",
    unknowns=Quantity("hub_torque_lag", "s", "time constant of the filter of the hub's torque", "tau", 0.0, 0.3),
    reference="low-pass filters of torque amplifiers: 2 to 100 Hz, 1.6 to 80 ms; currents on a bus: 5 to 50 ms",
    label="a hub torque behind a low-pass filter",
    signature="The torque residual is proportional to the time derivative of the torque, and large after its steps.",
    alike=("clock_offset", "hub_torque_delay"),
    confirm="Read the filter of the torque's amplifier. A torque step is rounded by a filter, and moved by a delay.",
    tags={"sensor", "latency", "wheel_spin"},
)
def hub_torque_lag(driven: Law, s: Signals, q: Signals) -> Number:
    """A torque at the hub that is logged behind a first-order low-pass filter: tau T_read' + T_read = T.

    The speed that the torque gives in a time is the integral of T / J, so that of T_read / J plus tau T_read / J.
    tau in s.
    """
    return driven(s) + q.hub_torque_lag * s.spun_by_torque
