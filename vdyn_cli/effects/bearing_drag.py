from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="bearing",
    unknowns=Quantity("bearing_drag", "N m s/rad", "drag torque of bearing and seals per speed", "cb", -0.02, 1.0),
    reference="wheel bearings with seals: 0.5 to 2 N m at 50 rad/s; a damaged one several times that",
    label="a bearing that drags",
    signature="The torque residual increases with wheel speed.",
    alike=("brake_drag", "hub_torque_offset", "rolling_resistance", "wheel_windage"),
    confirm="Jack the wheel up, spin it and measure its deceleration.",
    tags={"of_a_car", "wheel_spin"},
)
def bearing_drag(bearing: Law, s: Signals, q: Signals) -> Number:
    """Drag torque of bearing and seals between the sensor and the wheel, proportional to the speed.

    Tb = cb om, N m, om the wheel's speed, rad/s.
    """
    return bearing(s.but(bearing_torque=s.bearing_torque + q.bearing_drag * s.wheel_speed))
