from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="force_x",
    unknowns=Quantity("rolling_force", "", "rolling resistance per load in the force channel", "frr", -0.005, 0.05),
    reference="physics of SAE 2017-01-1574: 0.006 to 0.014 on roads; trucks 0.005, soft ground up to 0.05",
    label="rolling resistance in the longitudinal force",
    signature="Force over slip is shifted towards braking, in proportion to the load.",
    alike=("force_offset", "slip_offset"),
    confirm="Let the wheel roll freely at two loads: an offset stays, rolling resistance is proportional to the load.",
    tags={"test_only", "slip_sweep"},
)
def rolling_force(force_x: Law, s: Signals, q: Signals) -> Number:
    """A longitudinal force at the hub that includes the rolling resistance, which is not part of the curve over slip.

    F_read = F - frr Fz, N, with F the force by the curve and Fz the load, N.
    """
    return force_x(s) - q.rolling_force * s.load
