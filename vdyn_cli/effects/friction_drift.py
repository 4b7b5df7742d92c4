from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="friction",
    unknowns=Quantity("friction_drift", "1/s", "relative change of the friction per time in a sweep", "q", -0.03, 0.03),
    reference="a tread that heats or wears in sweeps loses 5 to 20 % of its friction in 10 s; a cold one gains as much",
    label="friction that changes in the course of a sweep",
    signature="The same slip gives a smaller, or a larger, force at the end of a sweep than at its start.",
    alike=("load_sensitivity", "friction_fade"),
    confirm="Sweep twice without a pause, then once more after cooling: the second sweep differs from the others.",
    tags={"test_only", "slip_sweep"},
)
def friction_drift(friction: Law, s: Signals, q: Signals) -> Number:
    """Friction of a tread that heats, wears or dries while each sweep lasts.

    mu = D (1 + q t), mu the peak friction and t the time since the start of the sweep, s.
    """
    return friction(s) * (1.0 + q.friction_drift * s.elapsed)
