from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="parameters",
    unknowns=Quantity("pitch_inertia_error", "", "relative error of the pitch inertia", "eI", -0.4, 0.6),
    reference="formulas for the pitch inertia of passenger cars scatter by 5 to 10 %; fuel, passengers and load in the "
    "boot add as much",
    label="an error in the pitch inertia",
    signature="The body pitches slower or faster than simulated, and the axles' loads shift against each other.",
    alike=("pitch_rate_gain", "cg_to_front", "unsprung_mass_rear_error"),
    confirm="Swing the car about an axle, or estimate the inertia with the step cg.",
    sense="of the stated inertia",
    tags={"bump_crossing"},
    corrects="sprung_pitch_inertia",
)
def pitch_inertia_error(parameters: Law, s: Signals, q: Signals) -> Number:
    """A body whose pitch inertia differs from the stated one.

    Is (1 + eI), kg m^2, with Is the pitch inertia of the sprung body about its center (kg m^2) and eI dimensionless.
    """
    return parameters(s.but(sprung_pitch_inertia=s.sprung_pitch_inertia * (1.0 + q.pitch_inertia_error)))
