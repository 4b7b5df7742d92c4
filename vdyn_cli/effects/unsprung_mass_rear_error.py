from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="parameters",
    unknowns=Quantity("unsprung_mass_rear_error", "", "relative error of the rear unsprung mass", "er", -0.5, 1.0),
    reference="unsprung masses are summed from drawings of wheel, brake, carrier and half of the links: 10 to 30 % of "
    "an axle's 70 to 100 kg is forgotten or counted twice",
    label="an error in the rear unsprung mass",
    signature="Wheel hop of the rear axle is slower or faster than simulated; the front axle's is as simulated.",
    alike=("rear_tire_stiffness", "logger_filter", "tire_damping"),
    confirm="Weigh a rear wheel with tire, brake and carrier, and half of the links and half-shaft.",
    sense="of the stated mass",
    tags={"bump_crossing"},
    corrects="unsprung_mass_rear",
)
def unsprung_mass_rear_error(parameters: Law, s: Signals, q: Signals) -> Number:
    """A rear axle whose unsprung mass differs from the stated one.

    mr (1 + er), kg, with mr the stated unsprung mass of the rear axle (kg) and er dimensionless. The mass of the car
    does not change.
    """
    return parameters(s.but(unsprung_mass_rear=s.unsprung_mass_rear * (1.0 + q.unsprung_mass_rear_error)))
