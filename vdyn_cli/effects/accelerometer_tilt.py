from vdyn_cli.effects import Law, Number, Quantity, Signals, effect, reads
from vdyn_cli.engine.maths import cos, sin
from vdyn_cli.quantities.constants import GRAVITY


@effect(
    on="acceleration",
    unknowns=Quantity("accelerometer_tilt", "rad", "angle by which the accelerometer's nose points up", "", -0.1, 0.1),
    reference="component of gravity along a tilted axis; mounting by eye is accurate to 1 to 3 deg",
    label="an accelerometer that is tilted",
    signature="The measured acceleration is larger by the same amount at all times and in both directions.",
    alike=("accelerometer_offset", "road_grade", "cg_to_rear"),
    confirm="Read the accelerometer at rest on one spot, facing both ways.",
    sense="nose up",
    tags={"sensor", "open_road", "pitching"},
)
def accelerometer_tilt(acceleration: Law, s: Signals, q: Signals) -> Number:
    """An accelerometer whose axis points upward: it measures a component of gravity.

    a_read = a cos(q) + g sin(q), q the axis's angle above the road, rad.
    """
    pull, share = GRAVITY * sin(q.accelerometer_tilt), cos(q.accelerometer_tilt)
    if reads(s):
        return acceleration(s) * share + pull
    return acceleration(s.but(value=(s.value - pull) / share))
