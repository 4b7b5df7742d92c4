from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import soft_abs, sqrt, tanh
from vdyn_cli.physics.laws.suspension import of_axle

STICK = 2e-4  # m of stroke until a strut slips
FASTEST = 2.5e-3  # s, in which friction changes its sign in the fastest strokes
STILL = 5e-5  # m/s, below which a strut is at rest
DRY = 1e-6  # m/s, smallest turning rate
RATED = 1e-4  # m/s, turning rate above which friction follows the stroke rate rather than the stroke
LAG = 5e-4  # s, time constant with which it follows the rate: half a step of the integration
BENT = 2e-6  # m of stroke within which it follows: 600 N on an axle of 70 kg then oscillate at less than 2.5 / ms


def bristle(s: Signals) -> Number:
    """Rate z', 1/s, of the friction's state z (-1 to 1), which follows the stroke and slips when fully deflected.

    z' = (1 - m^2) (v - |v| z^5) / sqrt(STICK^2 + (FASTEST v)^2) + m (tanh(v / w) - z) / (LAG + BENT / w)

    with m = w / (w + RATED), v the stroke rate and w the turning rate of the friction, m/s.

    The fifth power gives a spring with a sharp onset of slip. Both rates are limited, so that the integration is stable
    with steps of 1 ms. With w > 0, friction does not hold at rest, and z is tanh(v / w).
    Source: after Dahl, A Solid Friction Model, The Aerospace Corporation, TOR-0158(3107-18)-1, 1968.
    """
    v, z, w = s.stroke_rate, s.bristle, s.suspension_friction_rate
    turning = 0.5 * (w + sqrt(w * w + DRY**2))
    slipping = (v - soft_abs(v, STILL) * z**5) / sqrt(STICK**2 + (FASTEST * v) ** 2)
    turned = (tanh(v / turning) - z) * turning / (LAG * turning + BENT)
    rated = turning / (turning + RATED)
    return (1.0 - rated**2) * slipping + rated * turned


@effect(
    on="damper",
    unknowns=(
        Quantity("suspension_friction", "N", "dry friction in an axle's struts, mean of both axles", "Fc", -20, 600),
        Quantity("suspension_friction_rate", "m/s", "stroke rate within which the friction turns", "w", -0.005, 0.02),
        Quantity("suspension_friction_balance", "", "front less rear friction, over their sum", "b", -1.1, 1.1),
    ),
    nominal={"suspension_friction_rate": 0.0, "suspension_friction_balance": 0.0},
    reference="Dahl 1968; 50 to 200 N per wheel: Reimpell, Stoll, Betzler, The Automotive Chassis, 2nd ed. 2001, 5.4",
    states={"bristle": bristle},
    # A fit started at zero finds only friction below 100 N, because more holds the body where it stops
    probes=(400.0,),
    label="dry friction in the struts",
    signature="The load residual over stroke rate is a step at zero, equally high in slow and fast strokes.",
    alike=("asymmetric_damping", "tire_damping"),
    confirm="Rock the car slowly by hand over load cells: load over stroke is a loop with a height of twice the "
    "friction.",
    tags={"bump_crossing"},
)
def suspension_friction(damper: Law, s: Signals, q: Signals) -> Number:
    """Dry friction of struts, bushings and seals: a force of constant magnitude against the motion.

    F = C v + Fc z, N, v the stroke rate, m/s, where z from -1 to 1 follows the stroke over some tenths of a millimeter,
    or is tanh(v / w). Struts in front and at the rear are different parts: Fc (1 + b) in front, Fc (1 - b) at the rear.
    A call that represents a part of the axle has its share.
    """
    friction = q.suspension_friction * of_axle(s, q.suspension_friction_balance)
    return damper(s) + s.share * friction * s.bristle
