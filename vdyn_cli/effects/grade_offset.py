from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="logged_grade",
    unknowns=Quantity("grade_offset", "", "reading of the grade sensor on a level road", "i0", -0.03, 0.03),
    reference="mounting of inclinometers: 0.2 to 1 deg (0.35 to 1.7 %); zero of those on a vehicle's bus: up to 1 %",
    label="a grade sensor with a wrong zero",
    signature="A force that is the same at every speed in both directions; an accelerometer contradicts the logged "
    "grade by a constant.",
    alike=("torque_offset", "rolling_error", "accelerometer_offset"),
    confirm="Read the grade on one spot, facing both ways: half the sum of the two is the zero.",
    sense="on a level road",
    tags={"sensor", "driving"},
)
def grade_offset(logged_grade: Law, s: Signals, q: Signals) -> Number:
    """A grade sensor with a wrong zero, in the car's frame: the same on the way out and on the way back.

    i = i_read - i0, rise over run; its force is M g i0 / sqrt(1 + i^2). With no accelerometer it is collinear with the
    zero of a drive torque and with rolling resistance.
    """
    return logged_grade(s) - q.grade_offset
