from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="tire_vertical",
    unknowns=Quantity("tire_damping", "N s/m", "vertical damping of the two tires of an axle", "Ct", -100, 2_000),
    reference="50 to 500 N s/m per tire: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, chapter 9",
    label="damping in the tires",
    signature="The load residual follows the vertical speed of road and wheel, and wheel hop decays faster than "
    "simulated.",
    alike=("suspension_friction", "unsprung masses"),
    confirm="Let a wheel off the car bounce on the floor from a few centimeters, and measure how its height decays.",
    tags={"bump_crossing"},
)
def tire_damping(tire_vertical: Law, s: Signals, q: Signals) -> Number:
    """Tires that resist the rate of their deflection, in addition to their stiffness.

    Fz = max(0, F0 + Kt (u - z) + Ct (u' - z')), N, u the road's height, z the wheel's above rest, m. A call that
    represents a part of the axle's tires has its share.
    """
    return tire_vertical(s.but(damping=s.damping + s.share * q.tire_damping))
