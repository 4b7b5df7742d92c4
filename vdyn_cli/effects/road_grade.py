from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="grade",
    unknowns=Quantity("road_grade", "", "constant slope, uphill on the way out", "i", -0.03, 0.03),
    reference="weight along the road; range: SAE J1263 allows 0.5 % on a test road, public roads have more",
    label="a road slope",
    signature="Runs out and back differ by a force that is the same at every speed.",
    alike=("headwind", "rolling_resistance", "torque_offset", "accelerometer_offset"),
    confirm="Let the car roll slowly, below 20 km/h, in both directions over the same segment, or survey the road.",
    sense="uphill on the way out",
    tags={"test_only", "turns_with_heading", "open_road", "pitching"},
    covers=("road_slope",),
)
def road_grade(grade: Law, s: Signals, q: Signals) -> Number:
    """A constant slope that the description does not state: uphill on the way out, downhill on the way back.

    i = i_known + h i_road, heading h = +1 out, -1 back; its force is M g i / sqrt(1 + i^2).
    """
    return grade(s) + s.heading * q.road_grade
