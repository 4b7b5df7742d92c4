from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="grade",
    unknowns=Quantity("elevation_slope", "", "share of the slope of the logged elevation", "q", 0.0, 1.3),
    reference="a barometer or a map gives the slope within a tenth; a satellite receiver's elevation wanders by 5 to "
    "20 m within minutes: its share is then small",
    label="hills that the logged elevation shows",
    signature="The car loses speed wherever the logged elevation rises.",
    alike=("accelerometer_slope", "grade_profile", "road_grade", "headwind"),
    confirm="Drive the same road back: the hills must appear at the same places with the opposite sign.",
    tags={"test_only", "driving"},
)
def elevation_slope(grade: Law, s: Signals, q: Signals) -> Number:
    """Hills that a logged elevation shows, and that the simulation does not have.

    i = i_known + q i_z, q the share of the logged hills (1: as logged) and i_z the likeliest slope over the distance
    driven (``steps.elevation_grade``).
    """
    return grade(s) + q.elevation_slope * s.elevation_slope
