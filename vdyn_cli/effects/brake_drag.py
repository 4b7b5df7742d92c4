from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="brake",
    unknowns=Quantity("brake_drag", "N", "force at the road of brakes that do not release", "Fb", 0.0, 200.0),
    reference="residual brake torque of disc brakes, 1 to 6 N m per wheel: 10 to 80 N at the road",
    label="brakes that drag",
    signature="A force that is the same at every speed and in both directions slows the car.",
    alike=("rolling_resistance", "driveline_drag", "torque_offset", "bearing_drag"),
    confirm="Turn each jacked-up wheel with a torque wrench, before and after pushing its pads back. Then pump the "
    "pedal until it is firm.",
    tags={"of_a_car", "open_road", "wheel_spin"},
)
def brake_drag(brake: Law, s: Signals, q: Signals) -> Number:
    """Pads that rub with a constant force.

    F = Fb, N, for all wheels together, distributed equally. For a single wheel on a rig it is the force at its rim.
    """
    return brake(s.but(brake_force=s.brake_force + s.share * q.brake_drag))
