from vdyn_cli.effects import Law, Number, Quantity, Signals, effect

REFERENCE = 293.15  # K


@effect(
    on="rolling",
    unknowns=Quantity("temperature_rolling", "1/K", "decrease of rolling resistance per kelvin", "k", 0.0, 0.03),
    reference="coast-down standards correct by 8.6e-3 per kelvin to 20 degC; range: published tires have 5e-3 to 2e-2",
    label="rolling resistance that decreases with temperature",
    signature="Colder runs slow down faster, by a force that is the same at every speed.",
    alike=("tire_warmup", "rolling_resistance"),
    confirm="Repeat the runs on a day that is 10 K warmer or colder, and state each run's temperature.",
    tags={"between_runs", "open_road"},
)
def temperature_rolling(rolling: Law, s: Signals, q: Signals) -> Number:
    """Rolling resistance that depends on the temperature of each run, whereas the baseline has one for all runs.

    Rr = frr Fz / (1 + k (T - 20 degC)), N, T the temperature of the run and Fz the load, N. Needs runs with different
    stated temperatures.
    """
    warmer = s.temperature - REFERENCE
    return rolling(s.but(rolling_resistance=s.rolling_resistance / (1.0 + q.temperature_rolling * warmer)))
