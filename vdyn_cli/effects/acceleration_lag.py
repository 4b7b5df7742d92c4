from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on=("inertial", "speed_rate"),
    unknowns=Quantity("acceleration_lag", "s", "time constant of the acceleration's low-pass filter", "tau", 0.0, 0.2),
    reference="filters of accelerometers in loggers: 1 to 10 Hz, 16 to 160 ms (1 / (2 pi f) of one pole)",
    label="a low-pass filter of the acceleration",
    signature="Where the acceleration changes, the residual is proportional to its time derivative, and the reading is "
    "smoother than the loads.",
    alike=("acceleration_delay", "clock_offset", "pitch_inertia"),
    confirm="Read the filter's corner frequency in the logger's setup; log without it. A filter rounds a brake's "
    "onset, and a delay moves it.",
    tags={"sensor", "latency", "pitching"},
)
def acceleration_lag(reading: Law, s: Signals, q: Signals) -> Number:
    """An acceleration that is logged behind a first-order low-pass filter: tau a_read' + a_read = a, tau in s.

    So is every term of the balance that is computed from a_read; the filter acts on gravity in the reading, too.
    """
    return reading(s) + q.acceleration_lag * s.rate_of_change
