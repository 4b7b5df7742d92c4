"""A weather station's log: the air during each run, and the wind along and across the road."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vdyn_cli.io.channel_survey import ChannelFacts, recordings
from vdyn_cli.io.clocks.written_times import time_between
from vdyn_cli.io.file_units import is_unit
from vdyn_cli.io.reader import ChannelInfo
from vdyn_cli.quantities.arrays import Array, Mask
from vdyn_cli.quantities.quantity import UnitError, to_si

REDUCED = r"bar(o\w*)?( pressure)?\b"  # a pressure that may be reduced to sea level
_SECOND_CLOCK = 0.05  # relative difference of duration of a second clock of a log, which may be recorded more slowly
# Names of a station's columns, preferred ones first: a pressure reduced to sea level and a direction from magnetic
# north are used only without the other.
_NAMES: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "temperature": ("K", (r"((air|out(side)?|ambient|dry bulb) )?temp(erature)?s?( out(side)?)?", "(luft)?temperatur")),
    "pressure": ("Pa", (r"station p(ress(ure)?)?", r"((abs(olute)?|air) )?pressure", "luftdruck", REDUCED)),
    "humidity": ("", (r"rel(ative)? hum(idity)?", r"(out(side)? )?hum(idity)?", "rh")),
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
_OF_WEATHER = frozenset({"humidity", "wind_speed", "wind_direction"})
_OF_A_CAR = re.compile(
    r"(vehicle|gps|wheel|car|ground)?[ _]*(speed|velocity|spd|v)\b|engine|rpm|throttle", re.IGNORECASE
)


@dataclass(frozen=True)
class StationLog:
    """The samples of a weather station.

    Parameters
    ----------
    name : of the file.
    time : (n,) s since 1970, or since midnight if the file states no date.
    columns : the file's name of each quantity. values : (n,) of each, SI; angles from north of the wind's origin.
    unstated : quantities whose unit the file does not state, with values as they stand in the file.
    """

    name: str
    time: Array
    columns: Mapping[str, str]
    values: Mapping[str, Array]
    unstated: frozenset[str] = frozenset()

    def mean(self, quantity: str, span: tuple[float, float] | None) -> tuple[float, float] | None:
        """Mean and standard deviation of a quantity over a span (None: the whole log); None without values.

        SI, or in the file's unknown unit.
        """
        values = self.values.get(quantity)
        if values is None:
            return None
        some = values[self._within(span) & np.isfinite(values)]
        return (float(some.mean()), float(some.std())) if some.size else None

    def span_of(self, begin: float, length: float) -> tuple[float, float]:
        """First and last time, on the station's clock, of a run of ``length``, s, from ``begin`` on its own clock."""
        first = float(self.time[0]) + time_between(float(self.time[0]), begin)
        return first, first + length

    def wind(self, bearing: float, span: tuple[float, float]) -> tuple[float, float] | None:
        """Mean wind against the motion (positive: headwind) and across it (absolute), in m/s or the file's unknown
        unit; None if unknown.

        mean of w cos(a - b) and |mean of w sin(a - b)|, with a the angle from north of the wind's origin, b the bearing

        Parameters
        ----------
        bearing : direction of the run, degrees from north. span : first and last time, s, on the station's clock.
        """
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
        """Whether the station recorded during a whole span: its first and last time, s, on the station's clock."""
        step = (self.time[-1] - self.time[0]) / max(self.time.size - 1, 1)
        return bool(self.time[0] - step <= span[0] and span[1] <= self.time[-1] + step)

    def _within(self, span: tuple[float, float] | None) -> Mask:
        """The samples within a span, or the one closest to it if there is none."""
        if span is None:
            return np.ones(self.time.size, dtype=bool)
        there = (self.time >= span[0]) & (self.time <= span[1])
        if not there.any():
            there[int(np.argmin(np.abs(self.time - 0.5 * (span[0] + span[1]))))] = True
        return there


def is_station(facts: Sequence[ChannelFacts]) -> bool:
    """Whether a log is that of a weather station: temperature with other air or wind data, and no channel of a car.

    Without units, one of the others is the humidity or the wind, since engines also have temperatures and pressures.
    """
    found = _columns(facts)
    others = found if all(_stated(q, f.info) for q, f in found.items()) else found.keys() & _OF_WEATHER
    known = "temperature" in found and len({*others} - {"temperature"}) > 0
    return known and not any(_OF_A_CAR.match(f.column) for f in facts)


def station_log(path: Path, facts: Sequence[ChannelFacts]) -> StationLog | None:
    """The samples of the station's file at ``path``; None if its clock is not a time of day."""
    begin = clock_zero(facts)
    if begin is None:
        return None
    columns = {q: f.column for q, f in _columns(facts).items()}
    names = {one: q for q, one in columns.items()}
    unstated: set[str] = set()
    values: dict[str, Array] = {}
    time: Array = np.empty(0)
    for one in recordings(path):
        if one.time is not None and one.info.name in names and one.values is not None:
            quantity = names[one.info.name]
            time = one.time
            values[quantity] = one.values
            if _stated(quantity, one.info):
                values[quantity] = to_si(one.values, _unit(quantity, one.info), _NAMES[quantity][0])
            else:
                unstated.add(quantity)
    own = {q: c for q, c in columns.items() if q in values}
    return StationLog(path.name, time + begin, own, values, frozenset(unstated))


def clock_zero(facts: Sequence[ChannelFacts]) -> float | None:
    """The zero of a log's clock, s since 1970 or since midnight; None if it is not a time of day."""
    clock = next((f for f in facts if f.state == "clock"), None)
    if clock is None:
        return None
    if math.isfinite(clock.info.begin):
        return clock.info.begin
    if _since_1970(clock.info.span[0]):
        return 0.0
    return next((moment - clock.info.span[0] for f in facts if (moment := _second_clock(f, clock)) is not None), None)


def _second_clock(facts: ChannelFacts, clock: ChannelFacts) -> float | None:
    """The first time of a column that is a second clock; None for any other column.

    s since 1970 of a column in s or ms; s since 1970 or since midnight of a column of times of day.
    """
    length = clock.info.span[1] - clock.info.span[0]
    if math.isfinite(facts.info.begin) and abs(facts.ends[1] - facts.ends[0] - length) <= _SECOND_CLOCK * length:
        return facts.info.begin + facts.ends[0]
    for scale in (1.0, 1e-3):  # s, ms
        first, last = (scale * end for end in facts.ends)
        if _since_1970(first) and abs(last - first - length) <= _SECOND_CLOCK * length:
            return first
    return None


def _since_1970(time: float) -> bool:
    return 9e8 <= time <= 4e9


def _columns(facts: Sequence[ChannelFacts]) -> dict[str, ChannelFacts]:
    """The column of each quantity, by the most preferred of its names."""
    found: dict[str, ChannelFacts] = {}
    for quantity, (_, names) in _NAMES.items():
        fitting = (f for name in names for f in facts if _fits(quantity, name, f))
        if (column := next(fitting, None)) is not None:
            found[quantity] = column
    return found


def _fits(quantity: str, name: str, facts: ChannelFacts) -> bool:
    plain = " ".join(re.sub(r"[\[(].*?[\])]|[_.,]", " ", _name_and_unit(facts.info)[0]).split())
    if facts.state not in ("varies", "constant") or not re.fullmatch(name, plain, re.IGNORECASE):
        return False
    try:
        return not _stated(quantity, facts.info) or bool(to_si(1.0, _unit(quantity, facts.info), _NAMES[quantity][0]))
    except UnitError:
        return False


def _stated(quantity: str, info: ChannelInfo) -> bool:
    """Whether the unit is known; a direction without a unit is in degrees."""
    return bool(_name_and_unit(info)[1]) or quantity == "wind_direction"


def _unit(quantity: str, info: ChannelInfo) -> str:
    unit = _name_and_unit(info)[1]
    if quantity == "temperature" and unit in ("C", "F"):
        return f"deg{unit}"
    return unit or ("deg" if quantity == "wind_direction" else "")


def _name_and_unit(info: ChannelInfo) -> tuple[str, str]:
    """The name of a column without its unit, and the unit that the file states or that ends the name (``temp_C``)."""
    name, _, last = info.name.rpartition("_")
    ends = not info.unit and name and is_unit(last)
    return (name, last) if ends else (info.name, info.unit)
