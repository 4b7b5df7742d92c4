from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.physics.laws.suspension import of_axle


@effect(
    on="spring",
    unknowns=(
        Quantity(
            "progressive_spring", "1/m", "k2 in the force K x (1 + k2 x): the rate doubles at 1/(2 k2)", "k2", -5, 15
        ),
        Quantity("progressive_spring_balance", "", "front less rear k2, over their sum", "b", -1.1, 1.1),
    ),
    nominal={"progressive_spring_balance": 0.0},
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

    F = K x (1 + k2 x), N, for a compression x, m: stiffness K (1 + 2 k2 x), lower in extension. Front and rear springs
    are different parts: k2 (1 + b) in front, k2 (1 - b) at the rear.
    """
    curvature = q.progressive_spring * of_axle(s, q.progressive_spring_balance)
    return spring(s) - curvature * s.stiffness * s.stroke**2
