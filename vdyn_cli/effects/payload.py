from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="laden_mass",
    unknowns=Quantity("payload", "kg", "load that is not in the stated mass", "", -200.0, 500.0),
    reference="road loads are certified with 100 kg and a share of the payload; crew, fuel and freight differ",
    label="a load that is not in the stated mass",
    signature="The car accelerates too slowly, and rolls as if its tires carried more.",
    alike=("mass_error", "rotating_mass", "torque_gain", "wheel_radius"),
    confirm="Weigh the car as it was driven, with crew and freight.",
    tags={"driving", "of_a_car", "test_only"},
    corrects="mass",
)
def payload(laden_mass: Law, s: Signals, q: Signals) -> Number:
    """A load beside the mass with which a road load in N was measured: it adds inertia, weight and rolling resistance.

    M + q, kg, wherever mass enters, also in the rolling resistance F0 (1 + q/M), N. Where the rolling resistance is
    stated per weight, a wrong mass (``mass_error``) is the same.
    """
    return laden_mass(s) + q.payload
