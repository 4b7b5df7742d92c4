from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="friction",
    unknowns=Quantity(
        "braking_friction", "", "share by which friction in braking exceeds that in driving", "q", -0.3, 0.3
    ),
    reference="passenger car tires differ by up to 15 % (Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, ch. 4)",
    label="friction that differs between braking and driving",
    signature="Force over slip is larger on one side of zero slip than on the other by a constant factor.",
    alike=("rolling_force", "force_offset", "slip_offset"),
    confirm="Fit driving and braking with their own D and B: 'settings: {peaks: two}'.",
    tags={"slip_sweep"},
)
def braking_friction(friction: Law, s: Signals, q: Signals) -> Number:
    """A tire whose friction in braking is larger or smaller than in driving.

    mu = D (1 + q) in braking, mu = D in driving, mu the peak friction. The stiffness at zero slip differs likewise.
    """
    return friction(s) * (1.0 + q.braking_friction * s.braking)
