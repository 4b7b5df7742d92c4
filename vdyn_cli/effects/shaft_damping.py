from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="parameters",
    unknowns=Quantity("shaft_damping_error", "", "share by which both shafts damp more than given", "", -0.95, 3.0),
    reference="damping of steel shafts with joints is seldom known within a factor of two",
    label="half-shaft damping that differs from the given one",
    signature="After a torque step the half-shafts' oscillation decays faster or more slowly than simulated.",
    alike=("shaft_stiffness", "tire_relaxation", "backlash"),
    confirm="Step the torque and release it at once, several times, at one speed.",
    tags={"driving"},
)
def shaft_damping(parameters: Law, s: Signals, q: Signals) -> Number:
    """Half-shafts with a higher or lower damping than in the model, left and right by the same share.

    c (1 + q), c the stated damping, N m s/rad.
    """
    scale = 1.0 + q.shaft_damping_error
    left, right = s.shaft_damping_left * scale, s.shaft_damping_right * scale
    return parameters(s.but(shaft_damping_left=left, shaft_damping_right=right))
