from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="parameters",
    unknowns=Quantity(
        "wheel_inertia_error", "", "share by which the wheels' inertia exceeds the given one", "", -0.7, 1.0
    ),
    reference="doi:10.4271/2017-01-1574 finds 1.65 kg m^2 on the road and 1.25 kg m^2 on a pendulum for one wheel",
    label="a wrong moment of inertia of the wheels",
    signature="The car responds more slowly to a change of torque; the error increases with acceleration and braking.",
    alike=("rotating_mass", "motor_inertia", "torque_gain", "mass_error"),
    confirm="Swing a wheel on a pendulum.",
    tags={"driving"},
    corrects="wheel_inertia",
)
def wheel_inertia(parameters: Law, s: Signals, q: Signals) -> Number:
    """Wheels with a larger or smaller moment of inertia than in the model.

    Jw (1 + q), kg m^2, the same q for all four.
    """
    return parameters(s.but(wheel_inertia=s.wheel_inertia * (1.0 + q.wheel_inertia_error)))
