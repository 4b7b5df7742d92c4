"""The parts of the road load whose laws can be replaced by free curves."""

from __future__ import annotations

from dataclasses import replace

from vdyn_cli.engine.model_builder import Number, Signals
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.coastdown.fit.campaign import Campaign
from vdyn_cli.steps.free_part import ORDER, Part, sensor_part
from vdyn_cli.steps.free_profiles import span_of
from vdyn_cli.steps.road_load_parts import (
    ROAD_LOAD,
    directional_force,
    resistance_over_speed,
    resistance_over_time,
    road_load_signals,
)

SLOPE = 0.005  # plausible size: the slope of a road that counts as flat
READING = 0.3  # m/s, plausible error of a speed reading


def road_parts(campaign: Campaign) -> tuple[Part, ...]:
    """The parts: resistance over speed, over time in the run and over the day, directional force, road, speed reading.

    Parameters
    ----------
    campaign : the runs; the resistance over speed replaces their road load unknowns.
    """
    runs, known = campaign.runs, campaign.values
    speed = span_of([r.speed for r in runs], 1.0)
    day = span_of([r.start + r.since + r.time - r.time[0] for r in runs], 1.0)
    within = span_of([r.since + r.time - r.time[0] for r in runs], 1.0)
    names = {u.name for u in campaign.unknowns}
    rolling = tuple(n for n in ("rolling_resistance",) if n in names)
    own = tuple(n for n in ROAD_LOAD if n in names)
    road = () if campaign.road is not None else ("road",)  # without position a road looks like a force over time

    def over_time(coordinate: str, span: tuple[float, float], over: str) -> Part:
        part = resistance_over_time(coordinate, span, over)
        return replace(part, law=_rolling, arguments=road_load_signals(known), own=rolling)

    found = [
        resistance_over_speed(speed, known, own),
        replace(over_time("run_time", within, "time since the start"), inseparable=road),
    ]
    if any(r.start != runs[0].start for r in runs):  # else the time of day is not known
        found.append(over_time("elapsed", day, "time of day"))
    if campaign.both_ways:
        found.append(directional_force(speed, ("air", "wind_speed", "grade", "slope")))
    if campaign.road is not None:
        found.append(
            Part(
                "grade", "", "position", campaign.road, SLOPE, "", "m", "the road's slope", "position",
                anchored=False, called="road", reads=_place, factor="heading",
            )
        )  # fmt: skip
    if campaign.speed_fitted:
        found.append(sensor_part("speed", speed, READING, "m/s", "the speed reading"))
    order = min(ORDER, campaign.intervals or ORDER)
    return tuple(replace(p, order=order) if p.coordinate in ("speed", "run_time", "value") else p for p in found)


def _rolling(s: Signals) -> Number:
    """The part of the resistance that is the same at every speed, N."""
    return s.rolling_resistance * s.mass * GRAVITY


def _place(s: Signals) -> Number:
    return s.heading * s.position
