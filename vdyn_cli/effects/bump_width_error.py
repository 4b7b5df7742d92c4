from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="road",
    unknowns=Quantity("bump_width_error", "", "relative error of the bump's width", "ew", -0.3, 0.3),
    reference="edges of a bump of 0.3 to 0.5 m located to 5 to 10 mm give an error of 2 to 5 %",
    label="a bump width that differs from the description",
    signature="Each axle's time on the bump is longer or shorter than simulated; the rear axle follows as simulated.",
    alike=("speed_error", "tire_enveloping", "bump_trapezoid"),
    confirm="Measure the bump from edge to edge along the road.",
    sense="of the described width",
    tags={"bump_crossing", "test_only"},
)
def bump_width_error(road: Law, s: Signals, q: Signals) -> Number:
    """A bump whose true width differs from the described one.

    u = A shape(x / (lambda (1 + ew)))

    with u the road's height (m) at the distance x (m) from the bump's start, A the bump's height and lambda its
    described width (m), ew the relative error of lambda, and shape the bump's profile over 0 to 1.
    """
    return road(s.but(width=s.width * (1.0 + q.bump_width_error)))
