from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="shaft",
    unknowns=Quantity("series_compliance", "rad/(N m)", "twist per torque in series with the shaft", "s", -2e-6, 2e-4),
    reference="joints and splines make a half-shaft 20 to 60 % softer than its bar",
    label="compliant joints in series with the half-shaft",
    signature="The shaft is softer in the log than calculated from its drawing, at every torque and rate.",
    alike=("shaft_stiffness",),
    confirm="Clamp the shaft at its outer joint, apply a known torque at its inner end, read the twist at both ends.",
    tags={"shaft_twist", "beside_drawing", "test_only"},
)
def series_compliance(shaft: Law, s: Signals, q: Signals) -> Number:
    """Constant-velocity joints and splines that twist in series with the bar.

    1/k = 1/k_bar + s, k the shaft's stiffness and k_bar the bar's, N m/rad. Visible only in comparison with a drawing,
    or another measurement of the bar alone. Later steps do not add it: the published stiffness is that of both.
    """
    return shaft(s.but(stiffness=s.stiffness / (1 + s.stiffness * q.series_compliance)))
