from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import fabs


@effect(
    on="bearing",
    unknowns=Quantity("wheel_windage", "N m s^2/rad^2", "drag torque of the air per squared speed", "cw", -5e-5, 1e-3),
    reference="ventilation of a car's wheel: 1 to 5 N m at 100 rad/s (Wickern et al., SAE 970133)",
    label="wheel windage",
    signature="The torque residual increases with the square of the wheel's speed.",
    alike=("bearing_drag", "bearing_warmup"),
    confirm="Spin the wheel with its spokes covered by a disc.",
    tags={"wheel_spin"},
)
def wheel_windage(bearing: Law, s: Signals, q: Signals) -> Number:
    """Aerodynamic drag torque of spokes and tread, proportional to the squared speed.

    Tw = cw om |om|, N m, om the wheel's speed, rad/s.
    """
    turn = s.wheel_speed
    return bearing(s.but(bearing_torque=s.bearing_torque + q.wheel_windage * turn * fabs(turn)))
