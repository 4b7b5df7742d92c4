from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="friction",
    unknowns=Quantity(
        "load_sensitivity", "1/N", "share by which friction falls per newton of load", "k", -2e-5, 1.5e-4
    ),
    reference="Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, 4.3.2: 1 to 4 % per kN for passenger cars",
    label="friction that decreases with the load",
    signature="The friction of sweeps at a higher load is lower, most of all at the peak.",
    alike=("tire_D", "friction_fade"),
    confirm="Sweep at half and at twice the load, at one speed.",
    tags={"slip_sweep"},
)
def load_sensitivity(friction: Law, s: Signals, q: Signals) -> Number:
    """A friction coefficient that decreases with the vertical load.

    mu = D (1 - k (Fz - F0)), mu the peak friction, Fz the load, N, and F0 its mean over all sweeps.
    """
    return friction(s.but(tire_load_sensitivity=s.tire_load_sensitivity + q.load_sensitivity))
