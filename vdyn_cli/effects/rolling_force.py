from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="force_x",
    unknowns=Quantity("rolling_force", "", "share of the load by which the force reads too low", "frr", -0.03, 0.05),
    reference="rolling resistance: 0.006 to 0.014 on roads, soft ground up to 0.05 (SAE 2017-01-1574); a force sensor "
    "that is tilted by 1 deg reads 0.017 of the load, of either sign",
    label="a longitudinal force shifted by a share of the load (rolling resistance, a tilted sensor, or the tire's Sv)",
    signature="Force over slip is shifted, towards braking by rolling resistance, in proportion to the load.",
    alike=("force_offset", "slip_offset"),
    confirm="Let the wheel roll freely at two loads: an offset stays, a share of the load grows. Load it at rest: only "
    "a tilted sensor reads a force.",
    tags={"test_only", "slip_sweep"},
)
def rolling_force(force_x: Law, s: Signals, q: Signals) -> Number:
    """A longitudinal force that includes rolling resistance, crosstalk of the load, or the vertical shift of the curve.

    F_read = F - frr Fz, N, with F the force by the curve and Fz the load, N. The vertical shift Sv = -frr of the magic
    formula is the same: sweeps do not discriminate between the tire's own shift and a tilted sensor.
    """
    return force_x(s) - q.rolling_force * s.load
