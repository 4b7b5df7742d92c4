from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import exp


@effect(
    on="rolling",
    unknowns=(
        Quantity("run_warmup", "", "relative increase of rolling resistance at the start of a drive", "k", 0.0, 1.2),
        Quantity("run_warmup_time", "s", "time in which the increase falls to 37 %", "", 30.0, 1800.0),
    ),
    nominal={"run_warmup_time": 300.0},
    reference="rolling resistance decreases from about twice over 10 to 30 minutes (warm-up of SAE J1263 and WLTP)",
    label="tires that warm up in every drive",
    signature="Every drive begins with too much resistance in both directions, which decays within some minutes.",
    alike=("tire_warmup", "brake_drag_fading", "torque_drift", "rolling_resistance"),
    confirm="Drive for half an hour before the log begins: its first minutes must not differ from the rest.",
    tags={"test_only", "driving"},
)
def run_warmup(rolling: Law, s: Signals, q: Signals) -> Number:
    """Tires that have cooled before each drive, as where the drives are of several days.

    Rr = frr Fz (1 + k exp(-t/T)), N, Fz the load, N; t: seconds since the start of the drive's log. T is 300 s where
    the data do not determine it.
    """
    cold = exp(-s.run_time / q.run_warmup_time)
    return rolling(s.but(rolling_resistance=s.rolling_resistance * (1.0 + q.run_warmup * cold)))
