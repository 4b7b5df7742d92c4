from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="slip",
    unknowns=Quantity("slip_offset", "", "reading of the slip without slip", "s0", -0.05, 0.05),
    reference="1 % of wheel radius is 1 % of slip; unloaded, rolling and static radius differ by 1 to 4 %",
    label="a slip with a wrong zero",
    signature="The curve crosses zero force at a slip other than zero.",
    alike=("force_offset", "wheel_radius"),
    confirm="Let the wheel roll freely at the speed of the sweeps: its slip there is the zero.",
    tags={"sensor", "slip_sweep"},
)
def slip_offset(slip: Law, s: Signals, q: Signals) -> Number:
    """A slip computed with a wrong radius, or from a speed sensor with a wrong gain.

    s = (1 + s_read) (1 - s0) - 1, s the slip, a fraction: an error of s0 without slip, and of zero at a locked wheel.
    """
    read = slip(s)
    return read - (1 + read) * q.slip_offset
