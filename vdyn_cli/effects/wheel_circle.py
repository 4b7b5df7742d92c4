from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="road",
    unknowns=Quantity("wheel_circle", "", "share of a circle's path in that of the wheels", "c", -0.3, 1.5),
    reference="envelope of a circle: Schmeitz, A Semi-Empirical Three-Dimensional Model of the Pneumatic Tyre Rolling "
    "over Arbitrarily Uneven Road Surfaces, Delft 2004; 1 for a rigid circle, less for one that flattens on the bump",
    label="wheels that roll over the bump as circles",
    signature="The loads rise before the point under the wheel's center reaches the bump, and fall later.",
    alike=("bump_width_error", "tire_enveloping"),
    confirm="Cross a bump whose edges have a larger radius than the wheel: there the circle has no effect.",
    sense="of the way from point contact to a rigid circle of the wheels' radius",
    tags={"bump_crossing", "test_only"},
)
def wheel_circle(road: Law, s: Signals, q: Signals) -> Number:
    """Wheels that rest on the highest ground within their circle, and not on the ground under their center.

    u = (1 - c) u0 + c u_c,   u_c(x) = max over y of u0(x + y) - R + sqrt(R^2 - y^2)

    with u the height under the tire and u0 the road's (m), u_c the height of a circle's lowest point (m), R the wheels'
    radius (m). A circle bridges a hollow that curves more than it does, as at the feet of a short bump.
    """
    point = road(s)
    return point + q.wheel_circle * (road(s.but(shape=s.circle_shape)) - point)
