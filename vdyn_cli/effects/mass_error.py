from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="parameters",
    unknowns=Quantity("mass_error", "", "share by which the true mass exceeds the given one", "", -0.15, 0.15),
    reference="weighing without crew, fuel or equipment: two people and equipment are 10 % of a car",
    label="a wrong mass",
    signature="In coasts all forces have the same relative error; under power the car accelerates too fast or "
    "too slowly.",
    alike=("rotating_mass", "torque_gain", "wheel_radius", "rolling_resistance", "drag_area"),
    confirm="Weigh the car as it was driven, with crew and fuel.",
    # The rider of a light vehicle weighs more than the vehicle; a mass in lb is 2.2 times that in kg.
    possible={"mass_error": (-0.6, 2.0)},
    mistakes=((1 / 2.20462, "lb read as kg"), (2.20462, "kg read as lb")),
    tags={"open_road"},
    corrects="mass",
)
def mass_error(parameters: Law, s: Signals, q: Signals) -> Number:
    """A vehicle that is heavier or lighter than described.

    M (1 + q), kg, wherever mass enters: inertia, weight on the tires, slope.
    """
    return parameters(s.but(mass=s.mass * (1.0 + q.mass_error)))
