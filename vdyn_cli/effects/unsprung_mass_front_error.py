from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="parameters",
    unknowns=Quantity("unsprung_mass_front_error", "", "relative error of the front unsprung mass", "ef", -0.5, 1.0),
    reference="unsprung masses are summed from drawings of wheel, brake, carrier and half of the links: 10 to 30 % of "
    "an axle's 70 to 100 kg is forgotten or counted twice",
    label="an error in the front unsprung mass",
    signature="Wheel hop of the front axle is slower or faster than simulated; the rear axle's is as simulated.",
    alike=("tire_vertical_stiffness", "logger_filter", "tire_damping"),
    confirm="Weigh a front wheel with tire, brake and carrier, and half of the links and half-shaft.",
    sense="of the stated mass",
    tags={"bump_crossing"},
    corrects="unsprung_mass_front",
)
def unsprung_mass_front_error(parameters: Law, s: Signals, q: Signals) -> Number:
    """A front axle whose unsprung mass differs from the stated one.

    mf (1 + ef), kg, with mf the stated unsprung mass of the front axle (kg) and ef dimensionless. The mass of the car
    does not change.
    """
    return parameters(s.but(unsprung_mass_front=s.unsprung_mass_front * (1.0 + q.unsprung_mass_front_error)))
