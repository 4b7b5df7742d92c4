from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on="slip",
    unknowns=Quantity(
        "ground_speed_delay", "s", "time by which the vehicle speed lags the other channels", "tau", -0.1, 0.4
    ),
    reference="GPS receivers give their speed 7 to 160 ms late, and more where they filter it",
    label="a vehicle speed that is logged late",
    signature="Where the vehicle gains speed the slip is read too high, where it loses speed too low, at every slip.",
    alike=("slip_offset", "slip_lag", "tire_relaxation"),
    confirm="Accelerate and brake with the wheel rolling freely, and compare the vehicle speed with the wheel's.",
    tags={"sensor", "latency", "slip_sweep"},
)
def ground_speed_delay(slip: Law, s: Signals, q: Signals) -> Number:
    """A slip computed from a vehicle speed, often that of a GPS, that lags the wheel's speed and the forces.

    s = (1 + s_read) (1 - tau V'/V) - 1, with s the slip and V'/V the relative rate of the vehicle speed, 1/s; to first
    order in tau, s. At constant speed the slip does not depend on it.
    """
    read = slip(s)
    return read - (1 + read) * q.ground_speed_delay * s.speed_growth
