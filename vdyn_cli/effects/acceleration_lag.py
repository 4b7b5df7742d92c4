from vdyn_cli.effects import Law, Number, Quantity, Signals, effect


@effect(
    on=("inertial", "speed_rate"),
    unknowns=(
        Quantity("acceleration_lag", "s", "delay of the acceleration's low-pass filter", "tau", 0.0, 0.2),
        Quantity("acceleration_lag_form", "", "0: one pole; 1/3: Bessel, 1/2: Butterworth of two", "", -0.25, 0.75),
    ),
    nominal={"acceleration_lag_form": 0.0},
    reference="filters of accelerometers in loggers: 1 to 10 Hz, 16 to 160 ms (1 / (2 pi f) of one pole, "
    "1.41 times that of a Butterworth filter of two)",
    label="a low-pass filter of the acceleration",
    signature="Where the acceleration changes, the residual is proportional to its time derivative, and the reading is "
    "smoother than the loads.",
    alike=("acceleration_delay", "clock_offset", "pitch_inertia"),
    confirm="Read the filter's corner frequency in the logger's setup; log without it. A filter rounds a brake's "
    "onset, and a delay moves it.",
    tags={"sensor", "latency", "pitching"},
)
def acceleration_lag(reading: Law, s: Signals, q: Signals) -> Number:
    """An acceleration that is logged behind a low-pass filter: a_read + tau a_read' + k tau^2 a_read'' = a.

    tau in s; k is 0 for a filter of one pole, 1/4 for two equal ones, 1/3 for a Bessel and 1/2 for a Butterworth filter
    of two. The filter acts on every term of the balance that is computed from a_read, and on gravity in the reading.
    """
    tau = q.acceleration_lag
    return reading(s) + tau * (s.rate_of_change + q.acceleration_lag_form * tau * s.second_derivative)
