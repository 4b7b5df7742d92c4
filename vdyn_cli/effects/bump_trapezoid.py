from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import fmax, fmin


@effect(
    on="road",
    unknowns=(
        Quantity("bump_trapezoid", "", "share of a trapezoid in the bump's shape", "m", -0.5, 1.5),
        Quantity("bump_flat_share", "", "flat share of the trapezoid's width, in its middle", "p", 0, 0.8),
    ),
    nominal={"bump_flat_share": 0.4},
    reference="flat tops of 0.3 to 0.6 of the width: trapezoid bumps of parking lots and test tracks",
    label="a bump that is closer to a trapezoid than described",
    signature="On the bump the loads stay high for longer than simulated and change abruptly at its edges.",
    alike=("bump_width_error", "bump_height_error", "tire_enveloping"),
    confirm="Measure the bump's profile, and give it as 'profile'.",
    tags={"bump_crossing", "test_only"},
)
def bump_trapezoid(road: Law, s: Signals, q: Signals) -> Number:
    """A shape between the described one and a trapezoid of the same height and width.

    u = (1 - m) u0 + m A min(1, max(0, min(x, l - x)) / (l (1 - p) / 2))

    with u the road's height and u0 the described one (m) at the distance x (m) from the bump's start, A the bump's
    height and l its length (m).
    """
    ramp = s.length * (1.0 - q.bump_flat_share) / 2
    trapezoid = s.height * fmin(fmax(fmin(s.position, s.length - s.position), 0.0) / ramp, 1.0)
    described = road(s)
    return described + q.bump_trapezoid * (trapezoid - described)
