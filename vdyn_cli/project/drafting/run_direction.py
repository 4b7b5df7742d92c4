"""Direction of each run of a test, from a logged heading, or from latitude and longitude."""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from vdyn_cli.io.channel_survey import ChannelFacts
from vdyn_cli.io.file_units import words_and_unit
from vdyn_cli.quantities.quantity import UnitError, to_si

_DEVICE = r"(?:\S*/)?(?:(?:gps|gnss|ins|true|position)[ _.]*)*"
_IN_DEGREES = r"(?:[ _.]*deg(?:ree)?s?)?"  # LatitudeDegrees
_NO_MOTION = r"(?![a-z])(?![ _.]*(?:acc|g\b|vel|speed|rate|force|offset|error|std))"
_HEADING = re.compile(f"{_DEVICE}(?:heading|hdg|course|cog|bearing|kurs|track angle){_NO_MOTION}", re.IGNORECASE)
_LATITUDE = re.compile(
    f"{_DEVICE}(?:lat(?:itude)?|(?:geogr?[ _.]*)?breite(?:ngrad)?){_IN_DEGREES}{_NO_MOTION}", re.IGNORECASE
)
_LONGITUDE = re.compile(
    f"{_DEVICE}(?:longt?itude|long|lon|lng|(?:geogr?[ _.]*)?l(?:ae|ä)nge(?:ngrad)?){_IN_DEGREES}{_NO_MOTION}",
    re.IGNORECASE,
)
# Words in the names of logs for the two ways along a road: those of the first pair, others as seen from the first log.
_OPPOSITE = (
    (("out", "hin", "hinfahrt", "forth", "aller"), ("back", "her", "rück", "rueck", "rückfahrt", "return", "retour")),
    (("north", "nord", "northbound", "n", "nb"), ("south", "süd", "sued", "southbound", "s", "sb")),
    (("east", "ost", "eastbound", "e", "eb"), ("west", "westbound", "w", "wb")),
    (("uphill", "bergauf"), ("downhill", "bergab")),
)
_STRAIGHT = 0.9  # least length of the mean of unit vectors: headings within some 25 degrees of their mean
_WITHIN = 30.0  # degrees about one direction, or the opposite one, for all runs on a straight track
_SHORTEST_WAY = 100.0  # m between the ends of a run, below which positions give no direction
_TRACK = 50_000.0  # m between the ends of a run, above which two columns are not positions
METERS_PER_DEGREE = 111_200.0  # m per degree of latitude
_MOST_MINUTES = 180.0 * 60.0  # of arc, which VBOX writes
_SEMICIRCLE = 180.0 / 2.0**31  # degrees, of FIT files, whose columns are position_lat and position_long
_SCALED = 1e-7  # degrees, of u-blox receivers, MAVLink and PX4


@dataclass(frozen=True)
class LoggedDirection:
    """``out`` or ``back``, empty if unknown; the reason; and the bearing of the run, degrees from north."""

    direction: str
    why: str
    bearing: float | None = None


@dataclass(frozen=True)
class PlaceColumns:
    """The columns of latitude and longitude, and the degrees per unit of both."""

    north: ChannelFacts
    east: ChannelFacts
    degrees: float


def shows_direction(name: str) -> bool:
    """Whether a channel has the name of a heading, a latitude or a longitude."""
    return any(kind.match(name) for kind in (_HEADING, _LATITUDE, _LONGITUDE))


def place_columns(facts: Sequence[ChannelFacts]) -> PlaceColumns | None:
    """The columns of latitude and longitude by their names; by their values in degrees or minutes, else, by name and
    unit, in semicircles or 1e-7 degrees."""
    north, east = _named(_LATITUDE, facts), _named(_LONGITUDE, facts)
    if north is None or east is None:
        return None
    most = max(abs(x) for f in (north, east) for x in (f.lowest, f.highest))
    if most <= 180.0 and max(abs(north.lowest), abs(north.highest)) <= 90.0:
        return PlaceColumns(north, east, 1.0)
    if most <= _MOST_MINUTES:
        return PlaceColumns(north, east, 1.0 / 60.0)
    of_fit = "position" in north.column.lower() or "semicircle" in north.info.unit.lower()
    return PlaceColumns(north, east, _SEMICIRCLE if of_fit else _SCALED)


def logged_directions(logs: Sequence[Sequence[ChannelFacts]]) -> tuple[LoggedDirection, ...]:
    """The direction of each log; ``out`` is that of the first log with a known bearing, within ``_WITHIN`` degrees.

    The bearing is the mean of a heading, or that from the first to the last recorded place.

    Assumes : the runs are straight and on one road. A run that turns, or crosses the others, has no direction.

    Parameters
    ----------
    logs : facts on each log.
    """
    found = [_bearing(facts) for facts in logs]
    first = next((one[0] for one in found if one is not None), None)
    if first is None:
        return tuple(LoggedDirection("", "") for _ in logs)
    return tuple(
        LoggedDirection("", "neither heading nor position of this log shows the direction")
        if one is None
        else _along(first, *one)
        for one in found
    )


def named_directions(names: Sequence[str]) -> tuple[LoggedDirection, ...]:
    """The direction of each run by a word in the name of its log; all empty unless every name has a word of one pair,
    and both occur: "out" alone may be the output of a logger.

    Parameters
    ----------
    names : of the logs, one for each run; one log of several runs shows no direction.
    """
    words = [set(re.findall(r"[^\W\d_]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower())) for name in names]
    for one, other in _OPPOSITE:
        ways = [(any(w in one for w in own), any(w in other for w in own)) for own in words]
        if len(set(names)) == len(names) and set(ways) == {(True, False), (False, True)}:
            out = 0 if one == _OPPOSITE[0][0] else ways[0].index(True)
            return tuple(LoggedDirection("out" if way[out] else "back", "by the name of the log") for way in ways)
    return tuple(LoggedDirection("", "") for _ in names)


def _along(first: float, bearing: float, by: str) -> LoggedDirection:
    off = abs((bearing - first + 180.0) % 360.0 - 180.0)
    why = f"{by} {bearing:.0f} deg"
    if off <= _WITHIN:
        return LoggedDirection("out", why, bearing)
    if off >= 180.0 - _WITHIN:
        return LoggedDirection("back", why, bearing)
    return LoggedDirection("", f"{why}, neither along nor against the {first:.0f} deg of the first run", bearing)


def _bearing(facts: Sequence[ChannelFacts]) -> tuple[float, str] | None:
    """The bearing, degrees from north, and its source; None if unknown."""
    heading = _named(_HEADING, facts)
    if heading is not None and _degrees(heading) and abs(heading.angle) >= _STRAIGHT:
        return math.degrees(cmath.phase(heading.angle)) % 360.0, f"mean of '{heading.column}'"
    places = place_columns(facts)
    if places is None:
        return None
    north, east, scale = places.north, places.east, places.degrees
    shrunk = math.cos(math.radians(north.ends[0] * scale))
    y = (north.ends[1] - north.ends[0]) * scale * METERS_PER_DEGREE
    x = (east.ends[1] - east.ends[0]) * scale * METERS_PER_DEGREE * shrunk
    widest = math.hypot((north.highest - north.lowest) * scale, (east.highest - east.lowest) * scale * shrunk)
    if not _SHORTEST_WAY <= math.hypot(x, y) <= _TRACK or math.hypot(x, y) < _STRAIGHT * widest * METERS_PER_DEGREE:
        return None  # also if the log turns back, such as one of several runs
    return math.degrees(math.atan2(x, y)) % 360.0, f"from first to last '{north.column}' and '{east.column}'"


def _named(name: re.Pattern[str], facts: Sequence[ChannelFacts]) -> ChannelFacts | None:
    return next((f for f in facts if f.state in ("varies", "constant") and name.match(f.column)), None)


def _degrees(facts: ChannelFacts) -> bool:
    """Whether a heading is in degrees; one without a unit and within 2 pi may be in radians."""
    small = max(abs(facts.lowest), abs(facts.highest)) <= 2.0 * math.pi
    unit = facts.info.unit or words_and_unit(facts.column)[1] or ("rad" if small else "deg")
    try:
        return to_si(1.0, unit, "rad") == to_si(1.0, "deg", "rad")
    except UnitError:
        return False
