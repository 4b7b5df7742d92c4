"""Units of a speed and a driven distance that a file does not state, or states wrongly, from its places.

In windows of 10 s, or of 5 or 3 s in short logs, the way between two places, latitude and longitude, is compared with
the integral of the speed and with the change of the distance: the median ratio of the faster half of the windows is the
number of m/s or m per unit, a little below it in bends, where the way between the places is shorter than the driven
one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vdyn_cli.io.channel_survey import ChannelFacts, recordings
from vdyn_cli.io.quality.clock_gaps import clock_gaps
from vdyn_cli.project.drafting.channel_guess import ChannelGuess
from vdyn_cli.project.drafting.run_direction import METERS_PER_DEGREE, PlaceColumns, place_columns
from vdyn_cli.quantities.arrays import Array, cumulative_integral
from vdyn_cli.quantities.quantity import to_si

_WINDOWS = (10.0, 5.0, 3.0)  # s: 100 m at 10 or 30 m/s, along which the noise of two places is some percent
_FEWEST = 8  # windows of the faster half
_SHORTEST = 30.0  # m, median way of a window, below which noise of the places decides
_NEAR = 0.06  # relative difference from a unit's factor: mph and knots, the closest two, differ by 15 %
_SCATTER = 0.1  # relative median deviation of the windows, above which the columns are not of one motion
_SPEEDS = ("m/s", "km/h", "mph", "kn", "cm/s", "mm/s")
_DISTANCES = ("m", "km", "mile", "ft")


@dataclass(frozen=True)
class _LoggedPlaces:
    """Places (n,) of a log: time, s, and the coordinates to the north and east, m."""

    time: Array
    north: Array
    east: Array


def with_units_by_place(
    path: Path, facts: Sequence[ChannelFacts], guesses: Mapping[str, ChannelGuess]
) -> Mapping[str, ChannelGuess]:
    """The guesses, with the units of speed and position that the logged places decide, and without those that they
    contradict.

    Raises
    ------
    InputError : the file cannot be read.
    """
    open_ones = {
        channel: units
        for channel, units in (("speed", _SPEEDS), ("vehicle_speed", _SPEEDS), ("position", _DISTANCES))
        if (guess := guesses.get(channel)) is not None and guess.facts is not None
    }
    places = place_columns(facts)
    time = guesses.get("time")
    if not open_ones or places is None or time is None or time.unit == "?":
        return guesses
    named = {channel: guesses[channel].facts for channel in open_ones}
    wanted = {f.info.name for f in (places.north, places.east, *named.values()) if f is not None and f.repeated == 1}
    found = {r.info.name: (r.time, r.values) for r in recordings(path) if r.info.name in wanted}
    track = _track(places, found)
    decided = dict(guesses)
    for channel, units in open_ones.items():
        column = guesses[channel].column
        if track is None or column not in found:
            continue
        unit = _unit(track, *found[column], units, integrated=channel != "position")
        guess, agree = guesses[channel], f"only {unit} agrees with '{places.north.column}' and '{places.east.column}'"
        if unit and guess.unit == "?":
            decided[channel] = replace(guess, unit=unit, why=guess.why.replace(_open_reason(guess.why), agree))
        elif unit and not _same(unit, guess.unit, channel):
            decided[channel] = replace(guess, unit="?", why=f"{guess.why}; the file states {guess.unit}, but {agree}")
    return decided


def _same(unit: str, stated: str, channel: str) -> bool:
    """Whether two units are of one size, such as km/h and kph."""
    si = "m" if channel == "position" else "m/s"
    return abs(to_si(1.0, unit, si) / to_si(1.0, stated, si) - 1.0) <= _NEAR


def _open_reason(why: str) -> str:
    """The part of a guess's reason that says that the unit is open."""
    return next((part for part in why.split("; ") if "states no unit" in part), "")


def _track(places: PlaceColumns, found: Mapping[str, tuple[Array | None, Array | None]]) -> _LoggedPlaces | None:
    parts = [found.get(f.info.name, (None, None)) for f in (places.north, places.east)]
    (time, north), (also, east) = parts
    if time is None or north is None or also is None or east is None or north.size != east.size:
        return None
    there = np.isfinite(north) & np.isfinite(east) & np.isfinite(time)
    if not there.any():
        return None
    north, east = north[there] * places.degrees, east[there] * places.degrees
    meters = METERS_PER_DEGREE * np.cos(np.radians(np.median(north)))
    return _LoggedPlaces(time[there], north * METERS_PER_DEGREE, east * meters)


def _unit(
    track: _LoggedPlaces, time: Array | None, values: Array | None, units: Sequence[str], integrated: bool
) -> str:
    """The only unit that agrees with the track; empty if none does, or the windows do not decide."""
    if time is None or values is None:
        return ""
    there = np.isfinite(values) & np.isfinite(time)
    time, size = time[there], np.abs(values[there])
    if time.size < _FEWEST or track.time.size < _FEWEST:
        return ""
    driven = cumulative_integral(time, size) if integrated else size
    for window in _WINDOWS:
        ratios = _ratios(track, time, driven, window)
        if ratios.size >= _FEWEST:
            break
    else:
        return ""
    ratio = float(np.median(ratios))
    if ratio <= 0.0 or float(np.median(np.abs(ratios - ratio))) > _SCATTER * ratio:
        return ""
    si = "m/s" if integrated else "m"
    near = [unit for unit in units if abs(ratio / to_si(1.0, unit, si) - 1.0) <= _NEAR]
    return near[0] if len(near) == 1 else ""


def _ratios(track: _LoggedPlaces, time: Array, driven: Array, window: float) -> Array:
    """The way between places over the driven distance, in the faster half of the windows; none if the ways are short.

    Parameters
    ----------
    driven : (n,) at ``time``, in the unit of the file. window : length, s.
    """
    ends = np.arange(max(time[0], track.time[0]), min(time[-1], track.time[-1]), window)
    way = np.hypot(*(np.diff(np.interp(ends, track.time, x)) for x in (track.north, track.east)))
    change = np.abs(np.diff(np.interp(ends, time, driven)))
    whole = np.ones(way.size, dtype=bool)
    for clock in (time, track.time):
        for i in clock_gaps(clock):
            whole[(ends[1:] > clock[i]) & (ends[:-1] < clock[i + 1])] = False
    way, change = way[whole & (change > 0.0)], change[whole & (change > 0.0)]
    fast = change >= np.median(change) if change.size else np.empty(0, dtype=bool)
    if not fast.any() or np.median(way[fast]) < _SHORTEST:
        return np.empty(0)
    return np.asarray(way[fast] / change[fast])
