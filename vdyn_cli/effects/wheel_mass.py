from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="parameters",
    unknowns=Quantity("wheel_mass_error", "kg", "mass outside the force sensor minus the stated mass", "", -10, 10),
    reference="tires differ by 1 to 2 kg with tread and make, rims by 3 kg; the sensor's outer half weighs 3 to 5 kg",
    label="a wheel mass that differs from the stated one",
    signature="The torque residual is proportional to the car's acceleration and zero in steady driving.",
    alike=("wheel_inertia", "hub_torque_gain", "wheel_radius"),
    confirm="Weigh wheel, tire and the sensor's rotating half.",
    tags={"of_a_car", "wheel_spin"},
    corrects="wheel_mass",
)
def wheel_mass(parameters: Law, s: Signals, q: Signals) -> Number:
    """A wheel whose mass differs from the stated one, which changes the difference of hub and road forces.

    mw + q, kg. Because car and wheel accelerate together, only Jw + mw r^2 is observable.
    """
    return parameters(s.but(wheel_mass=s.wheel_mass + q.wheel_mass_error))
