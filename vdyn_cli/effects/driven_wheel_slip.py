from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="speed",
    unknowns=Quantity("driven_wheel_slip", "", "slip of driven wheels per force over weight", "k", 0.0, 0.25),
    reference="a tire's slip stiffness is 15 to 30 times its load; with half of the weight on the driven axle, k is "
    "0.07 to 0.13",
    label="a speed of driven wheels that slip",
    signature="The speed reads too high in proportion to drive force and speed, and too low under recuperation.",
    alike=("speed_delay", "torque_delay", "torque_lag", "speed_scale"),
    confirm="Compare the speed with that of wheels that are not driven, or of a GPS receiver, while accelerating.",
    tags={"driving"},
)
def driven_wheel_slip(speed: Law, s: Signals, q: Signals) -> Number:
    """A speed channel of driven wheels: it reads V (1 + k F / (M g)), with the force F of their tires.

    Only for the model of a mass on a road, whose sensor states ``traction`` = F / (M g). Assumes that the rotating mass
    is that of the driven wheels, and a linear slip, as below half of the friction.
    """
    return speed(s) * (1.0 + q.driven_wheel_slip * s.traction)
