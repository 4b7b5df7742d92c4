from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="speed",
    unknowns=Quantity("speed_error", "", "share by which the speed channel reads too high", "ev", -0.1, 0.1),
    reference="a worn or pumped-up tire: 1 to 3 %; a speedometer's lead: up to 10 % (UN Regulation 39)",
    label="a crossing speed with a wrong gain",
    signature="The delay between front and rear axle differs from wheelbase over speed by a constant factor.",
    alike=("wheelbase", "bump width"),
    confirm="Time the car between two marks at a measured distance.",
    tags={"sensor", "bump_crossing"},
)
def speed_error(speed: Law, s: Signals, q: Signals) -> Number:
    """A speed channel with a wrong gain, which changes the apparent length of bump and wheelbase.

    V = V_read / (1 + ev), m/s.
    """
    return speed(s) / (1 + q.speed_error)
