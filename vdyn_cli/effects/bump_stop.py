from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import fmax
from vdyn_cli.physics.laws.suspension import of_axle

BEYOND = 0.01  # m past the contact, where the stop's force is stated


@effect(
    on="spring",
    unknowns=(
        Quantity("bump_stop", "N", "force of an axle's stops 10 mm beyond the compression of contact", "F10", 0, 6000),
        Quantity("bump_stop_gap", "m", "compression from rest at which the bump stops engage", "g", 0.0, 0.08),
        Quantity("bump_stop_balance", "", "front less rear force, over their sum", "b", -1.1, 1.1),
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

    F = K x - F10 (max(0, -x - g) / 10 mm)^2, N, x the stroke, m, negative in compression. Front and rear stops are
    different parts: F10 (1 + b) in front, F10 (1 - b) at the rear.
    """
    beyond = fmax(-s.stroke - q.bump_stop_gap, 0.0) / BEYOND
    return spring(s) - s.share * q.bump_stop * of_axle(s, q.bump_stop_balance) * beyond * beyond
