from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import fmax
from vdyn_cli.physics.laws.suspension import of_axle


@effect(
    on="spring",
    unknowns=(
        Quantity("bump_stop", "1/m", "k2 of the stop's force K k2 (c - g)^2 beyond the gap g", "k2", 0, 1500),
        Quantity("bump_stop_gap", "m", "compression from rest at which the bump stops engage", "g", 0.0, 0.08),
        Quantity("bump_stop_balance", "", "front less rear k2, over their sum", "b", -1.1, 1.1),
    ),
    nominal={"bump_stop_gap": 0.02, "bump_stop_balance": 0.0},
    reference="polyurethane stops engage after 10 to 60 mm and give 1 to 3 kN in the next 10 to 20 mm",
    label="bump stops that engage",
    signature="The load residual over stroke is zero up to a compression and rises steeply beyond it.",
    alike=("progressive_spring", "asymmetric_damping"),
    confirm="Measure the gap of the stops at the parked car, and repeat the test with less motion than that.",
    tags={"bump_crossing"},
)
def bump_stop(spring: Law, s: Signals, q: Signals) -> Number:
    """Stops that add a progressive force where the suspension is compressed beyond a gap.

    F = K x - K k2 max(0, -x - g)^2, N, x the stroke, m, negative in compression. Front and rear stops are different
    parts: k2 (1 + b) in front, k2 (1 - b) at the rear.
    """
    beyond = fmax(-s.stroke - q.bump_stop_gap, 0.0)
    return spring(s) - s.stiffness * q.bump_stop * of_axle(s, q.bump_stop_balance) * beyond * beyond
