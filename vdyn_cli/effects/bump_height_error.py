from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="road",
    unknowns=Quantity("bump_height_error", "", "relative error of the bump's height", "eA", -0.3, 0.3),
    reference="a ruler read to 1 mm on a bump of 30 to 100 mm has an error of 1 to 3 %; a soft bump deflects by more",
    label="a bump height that differs from the description",
    signature="All loads and motions on the bump are larger or smaller by one factor; their timing is as simulated.",
    alike=("sprung and unsprung mass", "tire_enveloping"),
    confirm="Measure the bump's height at its middle and under a wheel that stands on it.",
    sense="of the described height",
    tags={"bump_crossing", "test_only"},
)
def bump_height_error(road: Law, s: Signals, q: Signals) -> Number:
    """A bump whose true height differs from the described one.

    u = A (1 + eA) shape(x / lambda)

    with u the road's height (m) at the distance x (m) from the bump's start, A its described height and lambda its
    width (m), and shape the bump's profile over 0 to 1.
    """
    return road(s.but(height=s.height * (1.0 + q.bump_height_error)))
