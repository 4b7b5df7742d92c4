from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="rolling",
    unknowns=Quantity("speed_dependent_rolling", "s/m", "increase of the coefficient with speed", "frr1", -4e-4, 4e-4),
    reference="b V of SAE J2452's P^a Z^b (a + b V + c V^2); range: the linear term of EPA road loads, up to 6 N s/m",
    label="rolling resistance that increases with speed",
    signature="The resistance residual is proportional to speed, equally in both directions.",
    alike=("drag_area", "extra_drag_area", "rolling_resistance"),
    confirm="Coast down over a wider range of speed: from the highest speed allowed to walking speed.",
    tags={"open_road", "over_weight"},
)
def speed_dependent_rolling(rolling: Law, s: Signals, q: Signals) -> Number:
    """Rolling resistance that increases with speed; in the baseline it is constant.

    Rr = (frr + (frr1 + q) V) Fz, N, V the speed, m/s, Fz the load, N, and frr1 the known slope, s/m.
    """
    return rolling(s.but(rolling_speed=s.rolling_speed + q.speed_dependent_rolling))
