from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.quantities.constants import GRAVITY


@effect(
    on="motion_moment",
    unknowns=Quantity(
        "pitch_axis", "m", "distance of the pitch axis below the center of gravity (negative: above)", "e", -0.3, 0.6
    ),
    reference="moments of a sprung body; suspension kinematics put the axis near the road or the wheel centers",
    label="a pitch axis away from the center of gravity",
    signature="The residual is proportional to the pitch angle; the estimated height is some percent too high.",
    alike=("cg_height", "accelerometer_tilt"),
    confirm="Lift the rear axle of the parked car by some degrees: the front axle's load gives the height directly.",
    tags={"pitching"},
)
def pitch_axis(motion_moment: Law, s: Signals, q: Signals) -> Number:
    """A center of gravity that moves to the rear when the nose rises, because the body turns about an axis below it.

    Its weight then adds the moment M g e th, N m nose-up, M the mass, kg, and th the pitch angle, rad.
    """
    return motion_moment(s) + s.mass * GRAVITY * q.pitch_axis * s.pitch
