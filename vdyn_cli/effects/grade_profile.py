from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import fabs, fmax

KNOTS = 36  # over the road: resolve dips and crests of a twentieth of it and longer
SLOPES = tuple(f"grade_{k}" for k in range(1, KNOTS + 1))
STEEP = 0.03  # slope that public roads seldom exceed for long


def _slope(name: str, knot: int) -> Quantity:
    return Quantity(name, "", f"slope at point {knot} of {KNOTS}, uphill on the way out", "i", -STEEP, STEEP)


@effect(
    on="grade",
    unknowns=tuple(_slope(name, k) for k, name in enumerate(SLOPES, 1)),
    reference="weight along the road, piecewise linear; range: public roads seldom exceed 3 % for long",
    label="a road that rises and falls",
    signature="The speed residual rises and falls at the same places of the road on every run, with opposite "
    "sign on the way back.",
    alike=("road_grade", "headwind", "brake_drag_fading"),
    confirm="Log the position, and drive the segment both ways from several start points, or survey its height.",
    sense="uphill on the way out",
    tags={"test_only", "open_road"},
    covers=("road_slope", "shared_road"),
)
def grade_profile(grade: Law, s: Signals, q: Signals) -> Number:
    """A slope that changes along the road, with the opposite sign on the way back.

    i = i_known + h sum_k i_k hat_k(h x), heading h = +1 out, -1 back; x m in the direction of driving, so that h x is
    the road's coordinate, increasing on the way out. The hat functions have equidistant knots from road_begin to
    road_end; beyond them the profile decreases to zero within one knot distance.
    """
    along = (s.heading * s.position - s.road_begin) / (s.road_end - s.road_begin) * (KNOTS - 1)
    slope: Number = 0.0
    for knot, name in enumerate(SLOPES):
        slope = slope + getattr(q, name) * fmax(1.0 - fabs(along - knot), 0.0)
    return grade(s) + s.heading * slope
