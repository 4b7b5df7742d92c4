from vdyn_cli.effects import Law, Number, Quantity, Signals, effect, reads


@effect(
    on="acceleration",
    unknowns=Quantity(
        "accelerometer_gain_error", "", "share by which the accelerometer reads too high", "e", -0.3, 0.3
    ),
    reference="gain error of inertial sensors: 1 to 3 %; more with a wrong range or sensitivity in the logger",
    label="an accelerometer with a wrong gain",
    signature="The error of the measured acceleration is proportional to the acceleration; speed and position agree.",
    alike=("speed_scale", "cg_height", "pitch of the body during acceleration"),
    confirm="Turn the accelerometer over, nose up and nose down: it has to read plus and minus 1 g.",
    tags={"sensor", "coasting", "pitching"},
    covers=("accelerometer_scale",),
)
def accelerometer_gain(acceleration: Law, s: Signals, q: Signals) -> Number:
    """An accelerometer whose gain is wrong.

    a_read = (1 + e) a, a the specific force, m/s^2.
    """
    gain = 1.0 + q.accelerometer_gain_error
    return acceleration(s) * gain if reads(s) else acceleration(s.but(value=s.value / gain))
