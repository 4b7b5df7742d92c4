"""A weather station's log beside the runs: the air during each run, and the wind along and across the road."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.channel_survey import ChannelFacts, recordings
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.quantity import UnitError, to_si

REDUCED = r"baro\w*( pressure)?"  # a pressure that may be reduced to sea level
_DAY = 86400.0  # s
_SECOND_CLOCK = 0.05  # share of its length by which a second clock of a log may differ: it is written more rarely
_LONGEST_DAY = 30 * _DAY  # s since midnight; a later time counts from 1970
# Names of a station's columns, the one to be preferred first: a pressure reduced to sea level, and a direction that
# counts from the magnetic north, only for want of the other.
_NAMES: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "temperature": ("K", (r"((air|outside|ambient|dry bulb) )?temp(erature)?s?( out(side)?)?", "(luft)?temperatur")),
    "pressure": ("Pa", (r"station p(ress(ure)?)?", r"((abs(olute)?|air) )?pressure", "luftdruck", REDUCED)),
    "humidity": ("", (r"rel(ative)? hum(idity)?", "humidity", "rh")),
    "wind_speed": ("m/s", (r"((mean|average|avg) )?wind ?(speed|spd)", "windgeschwindigkeit")),
    "wind_direction": (
        "rad",
        (
            r"(compass )?true dir(ection)?",
            r"direction \W*true",
            r"wind ?dir(ection)?",
            r"(compass )?mag\w* dir(ection)?",
        ),
    ),
}
_OF_A_CAR = re.compile(
    r"(vehicle|gps|wheel|car|ground)?[ _]*(speed|velocity|spd|v)\b|engine|rpm|throttle", re.IGNORECASE
)


@dataclass(frozen=True)
class StationLog:
    """What a weather station wrote.

    Parameters
    ----------
    name : of the file.
    time : (n,) s since 1970, or since midnight where the file states no date.
    columns : the file's name of each quantity. values : (n,) of each, SI; angles from north, from which the wind blows.
    """

    name: str
    time: Array
    columns: Mapping[str, str]
    values: Mapping[str, Array]

    def mean(self, quantity: str, span: tuple[float, float] | None) -> tuple[float, float] | None:
        """Mean and standard deviation of a quantity, SI, over a span, or all of the log; None without values."""
        values = self.values.get(quantity)
        if values is None:
            return None
        some = values[self._within(span) & np.isfinite(values)]
        return (float(some.mean()), float(some.std())) if some.size else None

    def span_of(self, begin: float, length: float) -> tuple[float, float]:
        """First and last moment, on the station's clock, of a run that began at ``begin``, s of its own clock."""
        first = float(self.time[0]) + between(float(self.time[0]), begin)
        return first, first + length

    def wind(self, bearing: float, span: tuple[float, float]) -> tuple[float, float] | None:
        """Means of the wind against the motion and across it, m/s; the run drives ``bearing`` degrees from north."""
        if not {"wind_speed", "wind_direction"} <= self.values.keys():
            return None
        speed, angle = self.values["wind_speed"], self.values["wind_direction"] - math.radians(bearing)
        there = self._within(span) & np.isfinite(speed) & (np.isfinite(angle) | (speed == 0.0))
        if not there.any():
            return None
        angle = np.where(np.isfinite(angle), angle, 0.0)
        along, across = (float(np.mean((speed * f(angle))[there])) for f in (np.cos, np.sin))
        return along, abs(across)

    def covers(self, span: tuple[float, float]) -> bool:
        """Whether it wrote during all of a span."""
        step = (self.time[-1] - self.time[0]) / max(self.time.size - 1, 1)
        return bool(self.time[0] - step <= span[0] and span[1] <= self.time[-1] + step)

    def _within(self, span: tuple[float, float] | None) -> NDArray[np.bool_]:
        """The samples of a span, or the one next to it where it is shorter than a step."""
        if span is None:
            return np.ones(self.time.size, dtype=bool)
        there = (self.time >= span[0]) & (self.time <= span[1])
        if not there.any():
            there[int(np.argmin(np.abs(self.time - 0.5 * (span[0] + span[1]))))] = True
        return there


def is_station(facts: Sequence[ChannelFacts]) -> bool:
    """Whether a log is that of a weather station: air or wind with a temperature, and nothing that a car has."""
    found = _columns(facts)
    return "temperature" in found and len(found) > 1 and not any(_OF_A_CAR.match(f.column) for f in facts)


def station_log(path: Path, facts: Sequence[ChannelFacts]) -> StationLog | None:
    """The station's samples; None where its clock states no time of day."""
    begin = absolute_begin(facts)
    if begin is None:
        return None
    columns = _columns(facts)
    names = {one: q for q, one in columns.items()}
    values: dict[str, Array] = {}
    time: Array = np.empty(0)
    for one in recordings(path):
        if one.time is not None and one.info.name in names and one.values is not None:
            quantity = names[one.info.name]
            time = one.time
            values[quantity] = to_si(one.values, _unit(quantity, one.info.unit), _NAMES[quantity][0])
    return StationLog(path.name, time + begin, {q: c for q, c in columns.items() if q in values}, values)


def absolute_begin(facts: Sequence[ChannelFacts]) -> float | None:
    """When the clock of a log counts zero, s since 1970 or since midnight; None where it states no time of day."""
    clock = next((f for f in facts if f.state == "clock"), None)
    if clock is None:
        return None
    if math.isfinite(clock.info.begin):
        return clock.info.begin
    if _since_1970(clock.info.span[0]):
        return 0.0
    return next((moment - clock.info.span[0] for f in facts if (moment := _second_clock(f, clock)) is not None), None)


def _second_clock(facts: ChannelFacts, clock: ChannelFacts) -> float | None:
    """The first time, s since 1970, of a column that counts from there as fast as the clock; None of any other."""
    length = clock.info.span[1] - clock.info.span[0]
    for scale in (1.0, 1e-3):  # s, ms
        first, last = (scale * end for end in facts.ends)
        if _since_1970(first) and abs(last - first - length) <= _SECOND_CLOCK * length:
            return first
    return None


def _since_1970(time: float) -> bool:
    return 9e8 <= time <= 4e9


def between(first: float, second: float) -> float:
    """Time from one moment to another, s; of those without a date, the nearest within half a day."""
    if min(first, second) > _LONGEST_DAY:
        return second - first
    return (second - first + 0.5 * _DAY) % _DAY - 0.5 * _DAY


def _columns(facts: Sequence[ChannelFacts]) -> dict[str, str]:
    """The column of each quantity: that of the earliest of its names."""
    found: dict[str, str] = {}
    for quantity, (_, names) in _NAMES.items():
        fitting = (f.column for name in names for f in facts if _fits(quantity, name, f))
        if (column := next(fitting, None)) is not None:
            found[quantity] = column
    return found


def _fits(quantity: str, name: str, facts: ChannelFacts) -> bool:
    plain = " ".join(re.sub(r"[\[(].*?[\])]|[_.,]", " ", facts.column).split())
    if facts.state not in ("varies", "constant") or not re.fullmatch(name, plain, re.IGNORECASE):
        return False
    try:
        to_si(1.0, _unit(quantity, facts.info.unit), _NAMES[quantity][0])
    except UnitError:
        return False
    return bool(facts.info.unit) or quantity == "wind_direction"


def _unit(quantity: str, unit: str) -> str:
    return unit or ("deg" if quantity == "wind_direction" else "")
