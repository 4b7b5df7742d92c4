"""Coasts that could be driven next: wider, both ways, warm, cold, on another day; simulated from the baseline's fit.

Every manoeuvre is a pair of coasts, out and back over the same level road in still air, after what was driven. How
fast such a car coasts from speed to speed follows from its forces: t = integral of (M + mr) dV / F(V).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.coastdown.road_load_fit import campaign_of, transferred
from vdyn_cli.steps.coastdown.road_runs import Campaign, RoadRun
from vdyn_cli.steps.manoeuvre import Manoeuvre

Array = NDArray[np.float64]

FASTER, FASTEST = 1.3, 130 / 3.6  # times the highest speed driven, up to what is legal somewhere, m/s
SLOWEST = 2.0  # m/s
WIDER = 1.1  # times the span of speeds driven: less is not another manoeuvre
SPACING = 0.5  # s between the samples of a simulated coast
LONGEST = 900.0  # s
SLIGHT = 1.0  # N, the least force reckoned with
REST = 60.0  # s between coasts
WARM = 3600.0  # s of driving, after which tires and brakes are warm
OTHER = 10.0  # K by which another day is colder or warmer
MILD = 288.0  # K, above which the other day is the colder one
WIND = frozenset({"headwind"})  # of its own on every day
COUNTS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


@dataclass(frozen=True)
class Coast:
    """From ``upper`` to ``lower`` (m/s), begun ``start`` s after the day's first, at ``temperature`` K."""

    upper: float
    lower: float
    start: float
    temperature: float
    air_density: float | None = None


@dataclass(frozen=True)
class Planned(Campaign):
    """Runs that nobody has driven, with the road, the model and the sensors' noise of those ``like`` them."""

    like: Campaign | None = None

    @property
    def driven_ones(self) -> Campaign:
        assert self.like is not None
        return self.like

    @cached_property
    def road(self) -> tuple[float, float] | None:
        return self.driven_ones.road

    @cached_property
    def model(self) -> Model:
        return self.driven_ones.model

    @cached_property
    def levels(self) -> tuple[Mapping[str, float], ...]:
        """Of samples that are fewer: the mean over a bin stays as quiet as it was."""
        found = self.driven_ones.levels
        typical = {n: float(np.mean([one[n] for one in found])) for n in found[0]}
        return (self._thinned(typical),) * len(self.runs)

    @cached_property
    def common_levels(self) -> Mapping[str, float]:
        return self._thinned(self.driven_ones.common_levels)

    def _thinned(self, levels: Mapping[str, float]) -> dict[str, float]:
        share = float(np.sqrt(min(_spacing(self.driven_ones) / SPACING, 1.0)))
        return {n: v * share for n, v in levels.items()}


def manoeuvres(regression: Regression, values: Mapping[str, float]) -> tuple[Manoeuvre, ...]:
    """The coasts that are worth thinking of, those with the least effort first.

    Parameters
    ----------
    regression : the coast-downs' own, with every cause in. values : of its shared unknowns at the baseline's fit.

    Notes
    -----
    None on an open road (``windows: powered``), where nothing is driven for the test.
    """
    campaign = campaign_of(regression)
    if campaign.accelerometer == "alone":
        return ()
    upper = float(np.median([r.speed[:5].mean() for r in campaign.runs]))
    lower = float(np.median([r.speed[-5:].mean() for r in campaign.runs]))
    top = max(upper, min(FASTER * max(float(r.speed.max()) for r in campaign.runs), FASTEST))
    now = max(r.start + r.since + float(np.ptp(r.time)) for r in campaign.runs) + REST
    usual = float(np.mean([r.temperature for r in campaign.runs]))
    coast = Coast(upper, lower, now, usual) if campaign.driven == "coasting" else Coast(top, SLOWEST, now, usual)
    there = OTHER if usual < MILD else -OTHER

    def made(how: str, one: Coast, most: int = 10, anew: frozenset[str] = frozenset()) -> Manoeuvre:
        def words(runs: int) -> str:
            return f"{runs} coasts from {_kmh(one.upper)} to {_kmh(one.lower)} km/h, {_count(runs // 2)} each way{how}"

        return Manoeuvre(words, lambda: transferred(regression, _pair(campaign, one, values), values), 2, most, anew)

    powered = campaign.driven != "coasting"
    wide = replace(coast, upper=top, lower=SLOWEST)
    wider = not powered and top - SLOWEST > WIDER * (upper - lower)
    found = []
    if not wider or {r.heading for r in campaign.runs} != {1.0, -1.0}:
        found.append(made(", the drive logged all the while" if powered else "", coast))
    if wider:
        found.append(made("", wide))
    if now < WARM:
        found.append(made(", after an hour's driving", replace(coast, start=WARM)))
    found.append(made(", with tires and brakes as cold as at the first run (start: 0 s)", replace(coast, start=0.0), 1))
    density = None
    if "air_density" not in {u.name for u in campaign.unknowns}:
        density = campaign.values["air_density"] * usual / (usual + there)
    other = replace(coast, temperature=usual + there, air_density=density)
    day = "warmer" if there > 0 else "colder"
    found.append(made(f", on a day that is {OTHER:.0f} K {day} (state both temperatures)", other, anew=WIND))
    return tuple(found)


def _pair(campaign: Campaign, one: Coast, values: Mapping[str, float]) -> Planned:
    at = {n: values.get(n, v) for n, v in campaign.values.items()}
    runs = tuple(_run(campaign, one, at, heading) for heading in (1.0, -1.0))
    return Planned(
        runs, campaign.driven, campaign.values, campaign.unknowns, campaign.accelerometer, campaign.white, campaign
    )


def _run(campaign: Campaign, one: Coast, at: Mapping[str, float], heading: float) -> RoadRun:
    time, speed = coasting(at, one.upper, one.lower)
    inputs: dict[str, Array | float] = {"grade": 0.0, "wind_speed": 0.0}
    if campaign.driven != "coasting":
        inputs[f"drive_{campaign.driven}"] = np.zeros_like(time)
    road = campaign.road
    return RoadRun(
        f"a coast {'out' if heading > 0 else 'back'}",
        time,
        speed,
        inputs,
        np.zeros(time.size, dtype=np.int64),
        acceleration=None if campaign.accelerometer == "none" else np.gradient(speed, time),
        heading=heading,
        start=one.start,
        temperature=one.temperature,
        air_density=one.air_density,
        place=None if road is None else road[0 if heading > 0 else 1],
    )


def coasting(at: Mapping[str, float], upper: float, lower: float) -> tuple[Array, Array]:
    """Time and speed (n,) of a coast of the car ``at``, on the level in still air; at most a quarter of an hour."""
    fall = np.linspace(upper, lower, 200)
    weight = at["mass"] * GRAVITY
    force = (at["rolling_resistance"] + at["rolling_speed"] * fall) * weight
    force = np.maximum(force + 0.5 * at["air_density"] * at["drag_area"] * fall**2, SLIGHT)
    slowness = (at["mass"] + at["rotating_mass"]) / force
    clock = np.r_[0.0, np.cumsum(-0.5 * (slowness[1:] + slowness[:-1]) * np.diff(fall))]
    time = np.arange(0.0, max(min(float(clock[-1]), LONGEST), 20 * SPACING), SPACING)
    return time, np.asarray(np.interp(time, clock, fall))


def _spacing(campaign: Campaign) -> float:
    return float(np.median([np.median(np.diff(r.time)) for r in campaign.runs]))


def _kmh(speed: float) -> str:
    return f"{3.6 * speed:.0f}"


def _count(number: int) -> str:
    return COUNTS[number] if number < len(COUNTS) else str(number)
