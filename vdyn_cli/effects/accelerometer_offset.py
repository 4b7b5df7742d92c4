from vdyn_cli.effects import Law, Number, Quantity, Signals, effect, reads


@effect(
    on="acceleration",
    unknowns=Quantity(
        "accelerometer_offset", "m/s^2", "reading of the accelerometer at rest on level ground", "a0", -1.0, 1.0
    ),
    reference="zero of inertial sensors: 0.01 to 0.1 m/s^2; a tilt of 1 deg is 0.17 m/s^2",
    label="an accelerometer with a wrong zero",
    signature="The measured acceleration differs by the same amount at all times and in both directions.",
    alike=("accelerometer_tilt", "road_grade", "cg_to_rear"),
    confirm="Read the accelerometer at rest on one spot, facing both ways.",
    tags={"sensor", "open_road", "pitching"},
)
def accelerometer_offset(acceleration: Law, s: Signals, q: Signals) -> Number:
    """An accelerometer with a wrong zero.

    a_read = a + a0, m/s^2.
    """
    if reads(s):
        return acceleration(s) + q.accelerometer_offset
    return acceleration(s.but(value=s.value - q.accelerometer_offset))
