from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="front_load",
    unknowns=Quantity("front_load_gain", "", "share by which the front loads read too high", "g", -0.15, 0.15),
    reference="wheel force sensors: 0.1 % of full scale; a sensor with another one's calibration: 5 to 10 %",
    label="front wheel loads with a wrong gain",
    signature="The front load is wrong by the same share at rest and on the bump; the rear load and the body's motion "
    "agree.",
    alike=("rear_load_gain", "mass", "cg_to_rear", "bump_height_error"),
    confirm="Put the front axle on scales with the sensors on.",
    tags={"sensor", "bump_crossing"},
)
def front_load_gain(front_load: Law, s: Signals, q: Signals) -> Number:
    """Load sensors of the front axle with a wrong gain.

    F_read = (1 + g) F, N.
    """
    return front_load(s) * (1 + q.front_load_gain)
