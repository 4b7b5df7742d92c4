"""The resistance to motion on a road as parts of a model: over speed, over time, and by direction."""

from __future__ import annotations

from collections.abc import Mapping

from vdyn_cli.engine.model_builder import Number, Signals
from vdyn_cli.physics.laws.air_drag import air
from vdyn_cli.physics.laws.rolling_resistance import rolling
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.free_part import Arguments, Part

FORCE = 100.0  # N, plausible size: two thirds of a car's rolling resistance
# Laws that are forces over speed and time as well, and what they are computed from.
RESISTANCES = ("air", "gust_drag", "rolling", "stated_rolling", "brake")
ROAD_LOAD = ("rolling_resistance", "rolling_speed", "drag_area")


def resistance_over_speed(speed: tuple[float, float], known: Mapping[str, float], own: tuple[str, ...] = ()) -> Part:
    """The resistance over a range of speed, m/s.

    Parameters
    ----------
    known : mass, air_density and ROAD_LOAD, SI. own : those that are unknowns of the fit.
    """
    return Part(
        "driveline", "", "speed", speed, FORCE, "N", "m/s", "the resistance to motion", "speed", anchored=False,
        law=_resistance, arguments=road_load_signals(known), own=own, called="road_load", related=RESISTANCES,
    )  # fmt: skip


def resistance_over_time(coordinate: str, span: tuple[float, float], over: str) -> Part:
    """The resistance over ``coordinate``, a time in s; ``over`` is the word for it."""
    return Part(
        "driveline", "", coordinate, span, FORCE, "N", "s", "the resistance to motion", over, anchored=False,
        called="road_load", related=RESISTANCES,
    )  # fmt: skip


def directional_force(speed: tuple[float, float], related: tuple[str, ...]) -> Part:
    """The force over speed, m/s, whose sign changes with the direction; ``related`` : laws that cause such forces."""
    return Part(
        "driveline", "", "speed", speed, FORCE, "N", "m/s", "the direction-dependent force (wind or slope)", "speed",
        anchored=False, called="directional_force", related=related, factor="heading",
    )  # fmt: skip


def road_load_signals(known: Mapping[str, float]) -> Arguments:
    """(coordinate, values of unknowns) -> signals of the resistance, from ``known`` where they are not unknowns."""
    return lambda at, values: {n: values.get(n, known[n]) for n in (*ROAD_LOAD, "mass", "air_density")}


def _resistance(s: Signals) -> Number:
    """Rolling resistance and air drag on a level road without wind, N."""
    return rolling(s.but(load=s.mass * GRAVITY, sense=1.0)) + air(s.but(wind=0.0))
