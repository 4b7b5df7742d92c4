from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="grade",
    unknowns=(Quantity("felt_slope", "", "share of the slope in the accelerometer's reading", "q", 0.0, 1.3),),
    reference="a forward accelerometer measures V' + g sin(slope): the road is this minus the rate of speed; share 1",
    label="hills that the accelerometer measured",
    signature="The car loses speed wherever the accelerometer reads more than the rate of the speed.",
    alike=("grade_profile", "road_grade", "headwind"),
    confirm="Drive the same road again, or back: the hills must appear at the same places, and agree with "
    "surveyed heights.",
    tags={"test_only", "driving"},
)
def felt_slope(grade: Law, s: Signals, q: Signals) -> Number:
    """Hills that an accelerometer in the car measured and that the simulation lacks.

    i = i_known + q i_felt, i_felt = (f - zero - V') / g - i_known, with f the specific force and V' the rate of the
    measured speed. i_felt does not depend on the torque: with a share of one it is the slope that the car climbed.
    """
    return grade(s) + q.felt_slope * s.felt_slope
