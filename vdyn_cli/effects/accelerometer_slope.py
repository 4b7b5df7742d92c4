from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="grade",
    unknowns=Quantity("accelerometer_slope", "", "share of the slope by the accelerometer", "q", 0.0, 1.3),
    reference="a forward accelerometer reads V' + g sin(slope); with exact sensors the share is 1",
    label="hills that the accelerometer measured",
    signature="The car loses speed wherever the accelerometer reads more than the rate of the speed.",
    alike=("grade_profile", "road_grade", "headwind"),
    confirm="Drive the same road again, in either direction: the hills must be at the same places and agree with "
    "surveyed heights.",
    tags={"test_only", "driving"},
)
def accelerometer_slope(grade: Law, s: Signals, q: Signals) -> Number:
    """Hills that an accelerometer in the car measured and that the simulation lacks.

    i = i_known + q i_a, i_a = (f - f0 - V') / g - i_known

    with i the slope, q its share (1: the hills are as measured), i_a the slope by the accelerometer beyond the known
    one, f the specific force along the car and f0 its zero (m/s^2), V' the rate of the measured speed (m/s^2). i_a does
    not depend on the torque.
    """
    return grade(s) + q.accelerometer_slope * s.accelerometer_slope
