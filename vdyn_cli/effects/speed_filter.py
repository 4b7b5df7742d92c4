from vdyn_cli.effects import Law, Number, Quantity, Signals, effect
from vdyn_cli.engine.maths import sqrt

SHORT = 0.05  # s, time constant with which the law filters at no filter, stable with steps of 50 ms


def time_constant_squared(tau_squared: Number) -> Number:
    """T^2 = (tau^4 + t0^4)^(1/2), s^2: square of the time constant with which the law filters; t0 is ``SHORT``."""
    return sqrt(tau_squared * tau_squared + SHORT**4)


def share(tau_squared: Number) -> Number:
    """Share w of the filtered speed in the reading: 0 without a filter, near 1 for a filter longer than ``SHORT``."""
    return 1.0 - sqrt(1.0 - tau_squared / time_constant_squared(tau_squared))


def ahead(clock: Law, s: Signals, q: Signals) -> Number:
    """Clock of the speed: its reading is taken the delay of the filter later."""
    return clock(s) + share(q.speed_filter) * sqrt(time_constant_squared(q.speed_filter))


def distance(s: Signals) -> Number:
    """Rate of the distance D between the speed, filtered with T, and the speed, m/s^2."""
    return -s.distance / sqrt(time_constant_squared(s.speed_filter)) - s.rate_of_change


def ramp(s: Signals) -> Number:
    """D where the speed has changed at its first rate for long, m/s."""
    return -sqrt(time_constant_squared(s.speed_filter)) * s.rate_of_change


@effect(
    on="speed",
    also={"speed_clock": ahead},
    unknowns=Quantity("speed_filter", "s^2", "squared time constant of the speed's filter", "tau^2", -0.03, 0.6),
    states={"distance": distance},
    starts={"distance": ramp},
    reference="speeds for instruments and on a vehicle's bus: filters of 0.1 to 0.7 s; GPS receivers: 0.1 to 0.5 s",
    label="a low-pass filter of the speed channel",
    signature="Changes of the measured speed are smaller and rounder, most where the torque alternates.",
    alike=("speed_delay", "speed_scale", "mass_error", "torque_lag"),
    confirm="Brake sharply from a constant speed: a filter rounds the corner, a delay moves it.",
    sense="(a time constant squared: 0.09 s^2 for 0.3 s; below zero: the torque is filtered)",
    tags={"sensor", "latency", "driving"},
)
def speed_filter(speed: Law, s: Signals, q: Signals) -> Number:
    """A speed channel behind a low-pass filter, whose delay is that of the channel.

    V_read(t) = V + w D at t + w T,  D' = -D / T - V',  T^4 = tau^4 + t0^4,  w = 1 - (1 - tau^2 / T^2)^0.5

    with t0 = 0.05 s and D, m/s, the distance of a speed filtered with T from V. For tau > t0 w is nearly 1: a filter
    with the time constant tau, s, without its delay, exp(tau s) / (1 + tau s). To the second order in s it is exact for
    every tau. It attenuates changes of the speed, like too small a gain of the speed or too large a mass.
    """
    return speed(s) + share(q.speed_filter) * s.distance
