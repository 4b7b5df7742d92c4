from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="parameters",
    unknowns=Quantity("shaft_stiffness_error", "", "share by which both shafts are stiffer than given", "", -0.8, 1.5),
    reference="joints and splines make a half-shaft 20 to 60 % softer than its bar",
    label="half-shaft stiffness that differs from the given one",
    signature="After a torque step the half-shafts oscillate at a different frequency than simulated.",
    alike=("motor_inertia", "tire_relaxation", "backlash", "shaft_damping"),
    confirm="Clamp the wheel and twist the inner end by a known torque, or step the torque at several speeds.",
    tags={"driving"},
)
def shaft_stiffness(parameters: Law, s: Signals, q: Signals) -> Number:
    """Half-shafts that are softer or stiffer than in the model, left and right by the same share.

    k (1 + q), k the stated stiffness, N m/rad.
    """
    scale = 1.0 + q.shaft_stiffness_error
    left, right = s.shaft_stiffness_left * scale, s.shaft_stiffness_right * scale
    return parameters(s.but(shaft_stiffness_left=left, shaft_stiffness_right=right))
