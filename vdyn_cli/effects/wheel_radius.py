from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="parameters",
    unknowns=Quantity(
        "wheel_radius_error", "", "share by which the true radius exceeds the given one", "", -0.06, 0.06
    ),
    reference="unloaded, rolling and static radius of a tire differ by 1 to 4 %; it increases by 1 % per 100 km/h",
    label="a wrong wheel radius",
    signature="The same torque gives less force, and the wheels turn slower at the same speed of the car.",
    alike=("torque_gain", "mass_error", "speed_scale", "wheel_mass"),
    confirm="Roll ten turns of the wheel along a tape, loaded as driven.",
    # A diameter stated as radius, or a small wheel without its tire.
    possible={"wheel_radius_error": (-0.6, 1.2)},
    mistakes=((0.5, "the diameter stated as radius"),),
    tags={"open_road", "wheel_spin"},
    corrects="wheel_radius",
)
def wheel_radius(parameters: Law, s: Signals, q: Signals) -> Number:
    """Wheels that are larger or smaller than described.

    r (1 + q), m, as lever of the torque and as rolling radius.
    """
    return parameters(s.but(wheel_radius=s.wheel_radius * (1.0 + q.wheel_radius_error)))
