from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="wheel_force",
    unknowns=Quantity("wheel_force_gain", "", "share by which all wheel loads read too high", "g", -0.1, 0.1),
    reference="wheel force sensors: 0.1 % of full scale, crosstalk of the longitudinal force up to 1 %",
    label="wheel loads with a wrong gain",
    signature="The relative error of every load is the same; at rest the sum of the loads differs from the weight.",
    alike=("cg_to_rear", "cg_height", "pitch_inertia", "mass_error"),
    confirm="Put the car on scales with the sensors on.",
    tags={"sensor", "pitching"},
)
def wheel_force_gain(wheel_force: Law, s: Signals, q: Signals) -> Number:
    """Wheel load sensors with a common gain error.

    F = F_read / (1 + g), N.
    """
    return wheel_force(s) / (1 + q.wheel_force_gain)
