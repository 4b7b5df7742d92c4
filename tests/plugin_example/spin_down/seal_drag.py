from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="spin_friction",
    unknowns=Quantity("seal_drag", "N m s/rad", "torque of the seal per angular speed", "c", -0.1, 0.1),
    reference="viscous friction of radial shaft seals: 1 to 20 mN m s/rad",
    label="a seal that drags with speed",
    signature="The wheel slows down faster at high speed than at low speed.",
    alike=("spin_torque",),
    confirm="Take the seal out and spin the wheel again.",
    tags={"free_spin"},
)
def seal_drag(spin_friction: Law, s: Signals, q: Signals) -> Number:
    """A seal whose torque is proportional to the angular speed.

    T = T0 + c om.
    """
    return spin_friction(s) + q.seal_drag * s.wheel_speed
