from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="parameters",
    unknowns=Quantity("extra_rotating_mass", "kg", "rotating mass that the description leaves out", "", -100.0, 300.0),
    reference="M + sum J/r^2: wheels add 3 to 4 % of the mass, coupled motor-generators 2 % more",
    label="rotating mass that the description leaves out",
    signature="The car accelerates and decelerates less than the forces require, but its weight on slopes agrees "
    "with the mass.",
    alike=("mass_error", "rolling_resistance", "drag_area", "torque_gain", "wheel_inertia", "motor_inertia"),
    confirm="Drive with a known large and small torque, or coast on a known slope: rotating mass adds inertia, "
    "but no weight.",
    tags={"of_a_car", "open_road"},
)
def rotating_mass(parameters: Law, s: Signals, q: Signals) -> Number:
    """Wheels, shafts and machines that turn with the car and are not in its rotating mass.

    (M + mr + q) V' = F, M the mass and mr the known rotating mass, kg, F the sum of the forces, N. In a model with
    single wheels, each receives a quarter as moment of inertia, q r^2 / 4.
    """
    if hasattr(s, "rotating_mass"):
        return parameters(s.but(rotating_mass=s.rotating_mass + q.extra_rotating_mass))
    turning = q.extra_rotating_mass * s.wheel_radius * s.wheel_radius / 4.0
    return parameters(s.but(wheel_inertia=s.wheel_inertia + turning))
