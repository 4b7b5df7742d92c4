from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


def _stated_force(mass: Law, s: Signals, q: Signals) -> Number:
    """The stated mass, by whose weight a rolling resistance in N was divided."""
    return mass(s.but(value=s.value / (1.0 + q.mass_error)))


def _coasted(drag_area: Law, s: Signals, q: Signals) -> Number:
    return drag_area(s.but(value=s.value * (1.0 + q.mass_error)))


@effect(
    on="parameters",
    also={"road_load_mass": _stated_force, "coasted_drag_area": _coasted},
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

    M (1 + q), kg, wherever mass enters: inertia, weight on the tires, slope. A road load that is stated in N does not
    change; a drag area from coast-downs with this mass, m^2, changes as the mass does, and their rolling resistance per
    weight not at all.
    """
    return parameters(s.but(mass=s.mass * (1.0 + q.mass_error)))
