from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="parameters",
    unknowns=Quantity(
        "motor_inertia", "kg m^2", "inertia missing in the model on the motor side of the half-shafts", "", -4.0, 8.0
    ),
    reference="geared motor-generators of a power-split transaxle: 3.3 kg m^2 at the wheels, 2 % of the car's mass",
    label="inertia of motors that the description leaves out",
    signature="While the car accelerates, the half-shaft torque is below the drive torque; the half-shafts "
    "oscillate at a lower frequency.",
    alike=("rotating_mass", "wheel_inertia", "torque_gain", "shaft_stiffness"),
    confirm="Step the torque and measure the half-shafts' frequency, or spin the wheels up off the ground.",
    tags={"driving"},
)
def motor_inertia(parameters: Law, s: Signals, q: Signals) -> Number:
    """Motors, gears and shafts on the inner side of the half-shafts whose inertia is not in the model.

    Jd + q, kg m^2, reduced to the driven wheels together: of all parts that turn with the differential's carrier.
    """
    return parameters(s.but(driveline_inertia=s.driveline_inertia + q.motor_inertia))
