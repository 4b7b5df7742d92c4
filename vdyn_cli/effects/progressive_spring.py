from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="spring",
    unknowns=Quantity(
        "progressive_spring", "1/m", "k2 of the force K x (1 + k2 x): the rate doubles at x = 1/(2 k2)", "k2", -5, 15
    ),
    reference="first nonlinear term of a spring's characteristic; a rate that doubles in 50 to 100 mm is that of "
    "a bump stop (5 to 10 1/m)",
    label="springs that stiffen in compression",
    signature="The load residual over stroke bends upward at both ends.",
    alike=("asymmetric_damping",),
    confirm="Load the parked car with ballast and measure ride height over axle load: the characteristic is curved.",
    tags={"bump_crossing"},
)
def progressive_spring(spring: Law, s: Signals, q: Signals) -> Number:
    """Springs whose stiffness increases with compression: progressive coils, bump stops, changing lever ratios.

    F = K x (1 + k2 x), N, for a compression x, m: stiffness K (1 + 2 k2 x), lower in extension.
    """
    return spring(s) - q.progressive_spring * s.stiffness * s.stroke**2
