from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import exp, log, soft_abs
from vdyn_cli.physics.laws.suspension import of_axle

LOW_SPEED = 0.2  # m/s, end of the low-speed range of a damper, where its valves begin to open: 0.05 to 0.3 m/s
CORNER = 2e-3  # m/s, over which the magnitude of the rate is rounded; far below the stroke rates of a bump


@effect(
    on="damper",
    unknowns=(
        Quantity("damping_degression", "", "one minus the exponent of force over rate in fast strokes", "p", -1.0, 0.9),
        Quantity("damping_degression_balance", "", "(front - rear) / (front + rear) degression", "b", -1.1, 1.1),
    ),
    nominal={"damping_degression_balance": 0.0},
    reference="Dixon, The Shock Absorber Handbook, 2nd ed., Wiley 2007: exponents of force over rate from 0.3 to 2",
    label="dampers that are not linear in the stroke rate",
    signature="The load residual over stroke rate bends the same way in rebound and compression, an S through zero.",
    alike=("suspension_friction", "tire_damping"),
    confirm="Measure the dampers' force at several constant rates on a dynamometer: force over rate is curved.",
    tags={"bump_crossing"},
)
def degressive_damping(damper: Law, s: Signals, q: Signals) -> Number:
    """Dampers whose force rises less (degressive valves) or more (orifices) than in proportion to the stroke rate.

    F = C v (1 + |v|/v0)^-p, N, v the stroke rate and v0 = 0.2 m/s: rate C at rest, and force over |v|^(1 - p) in fast
    strokes; p = 0 is linear, p < 0 progressive. Front and rear dampers are different parts: p (1 + b) in front, p (1 -
    b) at the rear.
    """
    exponent = q.damping_degression * of_axle(s, q.damping_degression_balance)
    factor = exp(-exponent * log(1.0 + soft_abs(s.stroke_rate, CORNER) / LOW_SPEED))
    return damper(s.but(stroke_rate=s.stroke_rate * factor))
