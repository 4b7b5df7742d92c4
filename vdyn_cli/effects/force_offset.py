from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="force_x",
    unknowns=Quantity("force_offset", "N", "reading of the force channel without force", "F0", -500, 500),
    reference="0.1 % of 24 kN is 24 N; rolling resistance contributes 30 to 60 N to the channel",
    label="a longitudinal force with a wrong zero",
    signature="The curve of force over slip is shifted by a constant force.",
    alike=("slip_offset",),
    confirm="Lift the wheel and read the force.",
    tags={"sensor", "slip_sweep"},
)
def force_offset(force_x: Law, s: Signals, q: Signals) -> Number:
    """A force channel with a constant error.

    F_read = F + F0, N.
    """
    return force_x(s) + q.force_offset
