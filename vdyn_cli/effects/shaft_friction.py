from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="shaft",
    unknowns=Quantity("shaft_friction", "N m", "dry friction in a half-shaft's joints and splines", "Fc", -10, 200),
    reference="ball joints lose 1 to 3 % of the torque; splines under load and the clamps of a rig up to 10 %",
    label="dry friction in the half-shaft's joints",
    signature="Torque over twist is a loop whose height is the same in slow and in fast cycles.",
    alike=("shaft_damping", "backlash"),
    confirm="Twist the shaft slowly to and fro: torque over twist is a loop with a height of twice the friction.",
    tags={"shaft_twist"},
)
def shaft_friction(shaft: Law, s: Signals, q: Signals) -> Number:
    """Dry friction of joints and splines: a torque of constant magnitude against the last change of the twist.

    T = k phi + c phi' + Fc z, N m, with z from -1 to 1 the direction of the last twist (``turned_twist``), which
    follows the twist over a milliradian. Source: Dahl, A Solid Friction Model, Aerospace Corporation, 1968.
    """
    return shaft(s) + q.shaft_friction * s.turned_twist
