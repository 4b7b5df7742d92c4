from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="friction",
    unknowns=Quantity("friction_fade", "s/m", "share of friction lost per sliding speed", "kv", -0.005, 0.06),
    reference="sliding friction of rubber on wet and dry roads: 0.5 to 3 % per m/s; ranges as in Pacejka 2012, 4.3.2",
    label="friction that decreases with sliding speed",
    signature="Beyond the peak, a fast sweep decreases more steeply than a slow one.",
    alike=("tire_C", "tire_E", "load_sensitivity"),
    confirm="Sweep beyond the peak at a third of the speed.",
    tags={"slip_sweep"},
)
def friction_fade(friction: Law, s: Signals, q: Signals) -> Number:
    """Peak friction that decreases with sliding speed, in addition to the curve's decrease over slip.

    mu = D (1 - kv |vs|), vs = s V, with mu the peak friction, vs the sliding speed, m/s, s the slip, V the speed.
    The signal ``sliding`` is |vs|.
    """
    return friction(s) * (1 - q.friction_fade * s.sliding)
