from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="shaft_torque",
    unknowns=Quantity(
        "inertia_before_shaft", "kg m^2", "inertia between the torque's measurement and the half-shaft", "J", -1, 10
    ),
    reference="motor and gears reduced to one wheel: 1 to 3 kg m^2 (single-seat race car), 1.7 (power-split hybrid)",
    label="an inertia between the torque's measurement and the half-shaft",
    signature="The torque residual is proportional to the acceleration of the motor: motor currents contain the torque "
    "that accelerates the motor itself.",
    alike=("shaft_stiffness", "shaft_damping", "torque_delay"),
    confirm="Measure the torque at the half-shaft by strain gauges, or spin up the motor with the half-shafts removed.",
    sense="at the half-shaft's speed",
    tags={"shaft_twist"},
)
def inertia_before_shaft(torque: Law, s: Signals, q: Signals) -> Number:
    """A torque that is measured before an inertia: by the motor's current, or at the input of a gear.

    T_read = T + J w', N m, w' the acceleration of the half-shaft's inner end, rad/s^2. Requires the motor's speed.
    """
    return torque(s) + q.inertia_before_shaft * s.motor_acceleration
