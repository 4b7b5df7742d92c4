from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="road",
    unknowns=(Quantity("bump_width_error", "", "relative error of the bump's width", "ew", -0.3, 0.3),),
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
    """
    return road(s.but(width=s.width * (1.0 + q.bump_width_error)))
