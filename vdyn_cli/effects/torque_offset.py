from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on=("drive_torque", "drive_torque_left", "drive_torque_right"),
    unknowns=Quantity("torque_offset", "N m", "reading of the drive torque without torque", "T0", -30.0, 30.0),
    reference="zero drift of torque flanges and of current sensors: up to 1 % of full scale",
    label="a drive torque with a wrong zero",
    signature="A force that is the same at every speed and torque accelerates or brakes the simulated car, also "
    "while coasting.",
    alike=("rolling_resistance", "brake_drag", "driveline_drag", "road_grade"),
    confirm="Read the torque channel with the wheels off the ground and at rest, before and after the drive.",
    sense="at no torque",
    tags={"of_a_car", "sensor", "open_road"},
)
def torque_offset(drive_torque: Law, s: Signals, q: Signals) -> Number:
    """A drive torque channel with a wrong zero.

    T = reading - T0

    with T the torque on the car and T0 the zero, N m. Two half-shaft sensors have the same T0.
    """
    return drive_torque(s.but(value=s.value - q.torque_offset))
