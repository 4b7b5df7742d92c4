from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="motion_moment",
    unknowns=Quantity("pitch_rate_gain", "", "share by which the pitch rate reads too high", "g", -0.1, 0.1),
    reference="gain error of gyroscopes: 0.1 to 0.5 % calibrated, 1 to 3 % not",
    label="a pitch rate with a wrong gain",
    signature="Pitch and pitch rate are wrong by the same share; the balance follows them with another pitch inertia.",
    alike=("pitch_inertia",),
    confirm="Turn the sensor on a table by 90 deg and integrate its rate.",
    tags={"sensor", "pitching"},
)
def pitch_rate_gain(motion_moment: Law, s: Signals, q: Signals) -> Number:
    """A gyroscope whose gain is wrong.

    q_read = (1 + g) q, q the pitch rate, rad/s. Pitch and pitch acceleration, which follow from it, have the same
    error.
    """
    gain = 1.0 + q.pitch_rate_gain
    return motion_moment(
        s.but(pitch=s.pitch / gain, pitch_rate=s.pitch_rate / gain, pitch_acceleration=s.pitch_acceleration / gain)
    )
