"""Effects for the engine's tests that are not in the catalog."""

from __future__ import annotations

from vdyn_cli.effects import effect
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.quantities.quantity import Quantity


@effect(
    on="rolling",
    unknowns=(Quantity("fading", "", "share", "", -1, 1), Quantity("fading_time", "s", "time", "", 1, 1000)),
    nominal={"fading_time": 20.0},
    states={"warmth": lambda s: (1 - s.warmth) / s.fading_time},
    reference="none",
)
def fading_drag(rolling: Law, s: Signals, q: Signals) -> Number:
    """Rolling resistance that fades as the tire warms up."""
    return rolling(s.but(rolling_resistance=s.rolling_resistance * (1 + q.fading * (1 - s.warmth))))


FADING = fading_drag


@effect(on="speed", unknowns=(Quantity("speed_gain", "", "gain"),), reference="none")
def speed_scale(speed: Law, s: Signals, q: Signals) -> Number:
    """A reading that is too large."""
    return speed(s) * (1 + q.speed_gain)


@effect(on="speed_clock", unknowns=(Quantity("latency", "s", "delay"),), reference="none")
def speed_delay(clock: Law, s: Signals, q: Signals) -> Number:
    """A reading that comes late."""
    return clock(s) - q.latency


@effect(on="parameters", unknowns=(Quantity("mass_share", "", "error"),), reference="none")
def mass_error(parameters: Law, s: Signals, q: Signals) -> Number:
    """A scale that was wrong."""
    return parameters(s.but(mass=s.mass * (1 + q.mass_share)))


@effect(on="air", unknowns=(Quantity("gust", "", "share"),), reference="none")
def needs_more(air: Law, s: Signals, q: Signals) -> Number:
    """Asks for a signal that nobody has."""
    return air(s) * (1 + q.gust * s.turbulence)


@effect(on="backlash", unknowns=(Quantity("gap", "rad", "gap"),), reference="none")
def elsewhere(law: Law, s: Signals, q: Signals) -> Number:
    """Corrects an element that the model lacks."""
    return law(s)
