"""The parts of the road load whose laws can be replaced by free curves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vdyn_cli.engine.model_builder import Number, Signals
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.coastdown.fit.campaign import Campaign
from vdyn_cli.steps.free_part import ORDER, Part, sensor_part
from vdyn_cli.steps.free_profiles import span_of

FORCE = 100.0  # N, plausible size: two thirds of a car's rolling resistance
SLOPE = 0.005  # plausible size: the slope of a road that counts as flat
READING = 0.3  # m/s, plausible error of a speed reading
RESISTANCES = ("air", "gust_drag", "rolling", "brake")  # laws that are forces over speed and time as well
OWN = ("rolling_resistance", "rolling_speed", "drag_area")


def road_parts(campaign: Campaign) -> tuple[Part, ...]:
    """The parts: resistance over speed, over time in the run and over the day, directional force, road, speed reading.

    Parameters
    ----------
    campaign : the runs; the resistance over speed replaces their road load unknowns.
    """
    runs = campaign.runs
    speed = span_of([r.speed for r in runs], 1.0)
    day = span_of([r.start + r.since + r.time - r.time[0] for r in runs], 1.0)
    within = span_of([r.since + r.time - r.time[0] for r in runs], 1.0)

    def arguments(at: float, values: Mapping[str, float]) -> Mapping[str, float]:
        given = {n: values.get(n, campaign.values[n]) for n in (*OWN, "mass", "air_density")}
        return {"speed": 0.0, **given}

    names = {u.name for u in campaign.unknowns}
    rolling = tuple(n for n in ("rolling_resistance",) if n in names)
    road = () if campaign.road is not None else ("road",)  # without position a road looks like a force over time
    found = [
        Part(
            "driveline", "", "speed", speed, FORCE, "N", "m/s", "the resistance to motion", "speed", anchored=False,
            law=_resistance, arguments=arguments, own=tuple(n for n in OWN if n in names), called="road_load",
            related=RESISTANCES,
        ),
        Part(
            "driveline", "", "run_time", within, FORCE, "N", "s", "the resistance to motion", "time since the start",
            anchored=False, law=_rolling, arguments=arguments, own=rolling, called="road_load", related=RESISTANCES,
            inseparable=road,
        ),
    ]  # fmt: skip
    if any(r.start != runs[0].start for r in runs):  # else the time of day is not known
        found.append(
            Part(
                "driveline", "", "elapsed", day, FORCE, "N", "s", "the resistance to motion", "time of day",
                anchored=False, law=_rolling, arguments=arguments, own=rolling, called="road_load", related=RESISTANCES,
            )
        )  # fmt: skip
    if {1.0, -1.0} <= {r.heading for r in runs}:
        found.append(
            Part(
                "driveline", "", "speed", speed, FORCE, "N", "m/s", "the direction-dependent force (wind or slope)",
                "speed",
                anchored=False, called="directional_force", related=("air", "wind_speed", "grade", "slope"),
                factor="heading",
            )
        )  # fmt: skip
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


def _resistance(s: Signals) -> Number:
    """Rolling resistance and air drag on a level road without wind, N."""
    rolling = (s.rolling_resistance + s.rolling_speed * s.speed) * s.mass * GRAVITY
    return rolling + 0.5 * s.air_density * s.drag_area * s.speed * np.abs(s.speed)


def _rolling(s: Signals) -> Number:
    """The part of the resistance that is the same at every speed, N."""
    return s.rolling_resistance * s.mass * GRAVITY


def _place(s: Signals) -> Number:
    return s.heading * s.position
