from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import exp


@effect(
    on="rolling",
    unknowns=(
        Quantity("tire_warmup", "", "relative increase of rolling resistance at the start of the day", "k", 0.0, 1.2),
        Quantity("tire_warmup_time", "s", "time in which the increase falls to 37 %", "", 100.0, 3600.0),
    ),
    nominal={"tire_warmup_time": 600.0},
    reference="rolling resistance decreases from about twice over 10 to 30 minutes (warm-up of SAE J1263 and WLTP)",
    label="tires that were still warming up",
    signature="Early runs slow down faster than late ones, and the difference decays within some ten minutes.",
    alike=("run_warmup", "brake_drag_fading", "temperature_rolling", "rolling_resistance"),
    confirm="Drive for half an hour and repeat the first runs: they must not differ from the last.",
    tags={"over_day", "test_only", "open_road"},
)
def tire_warmup(rolling: Law, s: Signals, q: Signals) -> Number:
    """Tires with a higher rolling resistance while they are cold.

    Rr = frr Fz (1 + k exp(-t/T)), N, Fz the load, N; t: seconds since the first run of the day began. T is 600 s where
    the data do not determine it.
    """
    cold = exp(-(s.elapsed + s.__dict__.get("run_start", 0.0)) / q.tire_warmup_time)
    return rolling(s.but(rolling_resistance=s.rolling_resistance * (1.0 + q.tire_warmup * cold)))
