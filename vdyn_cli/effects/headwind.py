from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="air",
    unknowns=Quantity("headwind", "m/s", "steady headwind along the out direction", "w", -8, 8),
    reference="drag of the relative air speed; range: SAE J1263 allows 4.4 m/s, gusts nearly twice",
    label="a headwind",
    signature="Runs out slow down faster than runs back; the difference increases with speed.",
    alike=("road_grade", "extra_drag_area", "rolling_resistance"),
    confirm="Drive the same track both ways from high to walking speed: the wind force decreases with the speed, "
    "the slope force does not.",
    sense="along the out direction",
    tags={"test_only", "turns_with_heading", "open_road"},
    every_day=1.5,
)
def headwind(air: Law, s: Signals, q: Signals) -> Number:
    """A steady wind along the track, against the vehicle on the way out and behind it on the way back.

    F = 1/2 rho Cd A (V + w h) |V + w h|, N, V the speed (m/s) and h the heading: +1 out, -1 back. Assumes no crosswind.
    """
    return air(s.but(wind=s.wind + s.heading * q.headwind))
