from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="tire",
    unknowns=(
        Quantity("braking_friction", "", "share by which friction in braking exceeds that in driving", "q", -0.3, 0.3),
        Quantity("braking_friction_steepness", "", "relative excess of B in braking, over that of D", "r", -3.0, 3.0),
    ),
    nominal={"braking_friction_steepness": 0.0},
    reference="passenger car tires differ by up to 15 % (Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, ch. 4)",
    label="friction that differs between braking and driving",
    signature="Force over slip is larger on one side of zero slip than on the other.",
    alike=("rolling_force", "force_offset", "slip_offset"),
    confirm="Fit driving and braking with their own D and B: 'settings: {peaks: two}'.",
    tags={"slip_sweep"},
)
def braking_friction(tire: Law, s: Signals, q: Signals) -> Number:
    """A tire whose friction in braking is larger or smaller than in driving.

    D (1 + q) and B (1 + r q) in braking, D and B in driving, factors of the magic formula. With r = 0 the slope at zero
    slip differs as the peak does; with r = -1 / (1 + q) it is the same on both sides.
    """
    more = q.braking_friction * s.braking
    steeper = 1.0 + q.braking_friction_steepness * more
    return tire(s.but(tire_D=s.tire_D * (1.0 + more), tire_B=s.tire_B * steeper))
