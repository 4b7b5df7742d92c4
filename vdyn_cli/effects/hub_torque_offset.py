from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="hub_torque",
    unknowns=Quantity("hub_torque_offset", "N m", "reading of the hub torque without torque", "T0", -50, 50),
    reference="0.1 % of full scale: 4 N m; warm-up and centrifugal drift of strain gauges several times that",
    label="a hub torque with a wrong zero",
    signature="The torque residual is the same at every speed and torque, in every run.",
    alike=("brake_drag", "bearing_drag", "rolling_resistance"),
    confirm="Jack the wheel up, turn it by hand both ways and read the torque; the mean of both is the zero.",
    tags={"of_a_car", "sensor", "wheel_spin"},
)
def hub_torque_offset(hub_torque: Law, s: Signals, q: Signals) -> Number:
    """A torque sensor at the hub with the same zero error in every run, beyond its data sheet.

    T = T_read - T0, N m.
    """
    return hub_torque(s) - q.hub_torque_offset
