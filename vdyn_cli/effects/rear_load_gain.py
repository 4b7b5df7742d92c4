from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="rear_load",
    unknowns=Quantity("rear_load_gain", "", "share by which the rear loads read too high", "g", -0.15, 0.15),
    reference="wheel force sensors: 0.1 % of full scale; a sensor with another one's calibration: 5 to 10 %",
    label="rear wheel loads with a wrong gain",
    signature="The rear load is wrong by the same share at rest and on the bump; the front load and the body's motion "
    "agree.",
    alike=("front_load_gain", "mass", "cg_to_rear", "bump_height_error"),
    confirm="Put the rear axle on scales with the sensors on.",
    tags={"sensor", "bump_crossing"},
)
def rear_load_gain(rear_load: Law, s: Signals, q: Signals) -> Number:
    """Load sensors of the rear axle with a wrong gain.

    F_read = (1 + g) F, N.
    """
    return rear_load(s) * (1 + q.rear_load_gain)
