from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import tanh
from vdyn_cli.physics.laws.suspension import of_axle

CORNER = 2e-3  # m/s, over which the two slopes meet; far below the stroke rates of a bump


@effect(
    on="damper",
    unknowns=(
        Quantity("damping_asymmetry", "", "rebound over compression slope, as (r - c)/(r + c)", "a", -0.9, 0.9),
        Quantity("damping_asymmetry_balance", "", "front less rear asymmetry, over their sum", "b", -1.1, 1.1),
    ),
    nominal={"damping_asymmetry_balance": 0.0},
    reference="Dixon, The Shock Absorber Handbook, 2nd ed., Wiley 2007: ratio 2 to 4 (0.33 to 0.6)",
    label="dampers that differ in rebound and compression",
    signature="The load residual over stroke rate is a V with its corner at zero.",
    alike=("progressive_spring", "suspension_friction"),
    confirm="Cross the bump slowly and fast: the slopes of force over stroke rate stay the "
    "same; with a progressive spring they change.",
    tags={"bump_crossing"},
)
def asymmetric_damping(damper: Law, s: Signals, q: Signals) -> Number:
    """Dampers that resist rebound (extension, positive stroke rate) more than compression.

    F = C (v + a |v|), N, v the stroke rate: slope C (1 + a) in rebound, C (1 - a) in compression. Front and rear
    dampers are different parts: a (1 + b) in front, a (1 - b) at the rear.
    """
    asymmetry = q.damping_asymmetry * of_axle(s, q.damping_asymmetry_balance)
    return damper(s) + asymmetry * s.damping * s.stroke_rate * tanh(s.stroke_rate / CORNER)
