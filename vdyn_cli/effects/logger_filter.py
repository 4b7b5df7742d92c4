from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import sqrt

SHORT = 8e-4  # s, below which the lag fades out, so that it vanishes at zero and a step of 1.1 ms stays stable


def time_constant_squared(tau: Number) -> Number:
    """T^2 = (tau^4 + t0^4)^(1/2), s^2: square of the time constant with which the law filters; t0 is ``SHORT``."""
    return sqrt(tau * tau * tau * tau + SHORT**4)


def lagging(s: Signals) -> Number:
    """Rate of the lagged signal relative to rest, per second."""
    return (s.value - s.rest - s.lagged) / sqrt(time_constant_squared(s.logger_filter))


@effect(
    on=("front_load", "rear_load", "vertical_acceleration", "pitch_rate"),
    unknowns=Quantity("logger_filter", "s", "time constant of a low-pass filter of all channels", "tau", 0, 0.02),
    states={"lagged": lagging},
    reference="anti-alias filters of loggers: 10 to 100 Hz; tau = 0.16 / f of one pole, 0.13 / f of a Bessel filter "
    "with the corner f",
    # A short lag beyond its delay changes a signal by tau^2/2 times its second derivative: nothing to first order
    probes=(0.002, 0.004, 0.008),
    label="a low-pass filter in the logger",
    signature="Peaks in all channels are lower and smoother than simulated, and more so at a higher speed.",
    alike=("tire_enveloping", "bump_width_error", "tire_vertical_stiffness"),
    confirm="Read the filter's corner frequency in the logger's setup; log without it, or at 200 Hz or more.",
    tags={"sensor", "latency", "bump_crossing"},
)
def logger_filter(reading: Law, s: Signals, q: Signals) -> Number:
    """A logger that filters loads and motion alike: one pole, tau y' + y = x, with the reading y of x.

    Its delay, equal in all channels, looks like another position of the bump. Near t0 = 0.8 ms the reading is
    w y + (1 - w) x with w = tau^2 / T^2, T^2 = (tau^4 + t0^4)^(1/2) and the time constant T, so that tau = 0 changes
    nothing.
    """
    share = q.logger_filter * q.logger_filter / time_constant_squared(q.logger_filter)
    true = reading(s)
    return true + share * (s.lagged + s.rest - true)
