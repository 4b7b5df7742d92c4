from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on=("air", "gust_drag"),
    unknowns=Quantity("extra_drag_area", "m^2", "drag area of sensors, cables and open windows", "dCdA", -0.3, 0.5),
    reference="doi:10.4271/2017-01-1574 names sensors and cables as the cause; range: wheel force sensors with "
    "rods about 0.1 m^2",
    label="drag area that the description leaves out",
    signature="The car slows down faster at high speed only, equally on every run and in both directions.",
    alike=("drag_area", "air_density", "headwind", "speed_dependent_rolling"),
    confirm="Coast down from the same speed with the measuring equipment removed, or from a higher speed.",
    tags={"of_a_car", "open_road"},
)
def extra_drag_area(air: Law, s: Signals, q: Signals) -> Number:
    """Drag area that is not in the baseline: external measuring equipment, an open window, a roof rack.

    F = 1/2 rho (Cd A + dCdA) (V + w) |V + w|, N, V the speed and w the headwind, m/s. Collinear with Cd A where that is
    estimated.
    """
    return air(s.but(drag_area=s.drag_area + q.extra_drag_area))
