from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="force_z",
    unknowns=Quantity("load_offset", "N", "reading of the load channel without load", "Z0", -500, 500),
    reference="0.1 % of 24 kN is 24 N; weight of wheel and tire, if zeroed with the wheel lifted, is 150 to 400 N",
    label="a vertical load with a wrong zero",
    signature="Fx / Fz differs from sweep to sweep by a share that falls with the load, also at small slip.",
    alike=("load_sensitivity", "tire_D"),
    confirm="Lift the wheel and read the load; sweep at a third of the load, where the error is three times as large.",
    tags={"sensor", "slip_sweep"},
)
def load_offset(force_z: Law, s: Signals, q: Signals) -> Number:
    """A load channel with a constant error.

    Fz = Fz_read - Z0, N. The force is Fz times the curve, so that its ratio to the reading is (1 - Z0 / Fz_read) times
    the curve. Sweeps under one load show only a change of D by that share.
    """
    return force_z(s) - q.load_offset
