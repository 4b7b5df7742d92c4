"""Start, air and wind of each run for ``vdyn init``, from times of day and a weather station."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise

from vdyn_cli.io.channel_survey import ChannelFacts
from vdyn_cli.io.clocks.written_times import time_between
from vdyn_cli.project.drafting.logged_air import logged_air
from vdyn_cli.project.drafting.run_direction import LoggedDirection
from vdyn_cli.project.drafting.station_log import REDUCED, StationLog, clock_zero
from vdyn_cli.quantities.quantity import from_si

_AIR = {"temperature": ("degC", "K", 1), "pressure": ("kPa", "Pa", 2), "humidity": ("%", "", 0)}
_ALIKE = 1.0  # K between runs, below which one temperature is used for all
_LONGEST_TEST = 86400.0  # s between the first and the last run
_UNKNOWN_STARTS = (
    "without 'start' in each run (the logs state none), the runs are taken as driven in this order without pauses"
)


@dataclass(frozen=True)
class DayConditions:
    """Further keys of each run, as text after its log, the logged values for ``environment``, and notes."""

    keys: tuple[str, ...]
    air: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()


def run_conditions(
    logs: Sequence[Sequence[ChannelFacts]],
    ways: Sequence[LoggedDirection],
    station: StationLog | None,
    read: Collection[str],
) -> DayConditions:
    """Start, wind and temperature of each run.

    Parameters
    ----------
    logs : facts on each run's log. ways : direction of each run; empty if none is known.
    station : None without a weather station. read : the keys of a run that the step reads.
    """
    begins = [_first_moment(facts) for facts in logs]
    keys: list[list[str]] = [[] for _ in logs]
    starts = logged_starts(logs) if "start" in read else ()
    for own, start in zip(keys, starts, strict=False):
        own.append(f"start: {start:.1f} s")
    notes = [_UNKNOWN_STARTS] if "start" in read and len(logs) > 1 and not starts else []
    if station is None:
        return DayConditions(tuple(", ".join(("", *own)) for own in keys), logged_air(logs), tuple(notes))
    during, air, note = air_during(station, [(b, _length(facts)) for b, facts in zip(begins, logs, strict=True)])
    notes.append(note)
    if during and len(during) == len(logs):
        _add_temperatures(keys, station, during, read)
        notes.append(_add_winds(keys, station, during, ways, read))
    return DayConditions(tuple(", ".join(("", *own)) for own in keys), air, tuple(note for note in notes if note))


def logged_starts(logs: Sequence[Sequence[ChannelFacts]]) -> tuple[float, ...]:
    """Start of each log, (logs,) s after that of the first, by times of day or by one clock of all; empty if unknown.

    Parameters
    ----------
    logs : facts on each run's log.
    """
    begins = [_first_moment(facts) for facts in logs]
    common = _on_one_clock(logs) if not any(b is not None for b in begins) else []
    known = common or [b for b in begins if b is not None]
    if not len(known) == len(logs) > 1:
        return ()
    starts = tuple(time_between(known[0], b) for b in known)
    alike = len(set(starts)) < len(starts) or max(starts) - min(starts) >= _LONGEST_TEST
    return () if alike else starts


def air_during(
    station: StationLog, runs: Sequence[tuple[float | None, float]]
) -> tuple[list[tuple[float, float]], tuple[tuple[str, str], ...], str]:
    """The spans of the runs that a station covers, on its clock, its values for ``environment``, and a note.

    Parameters
    ----------
    runs : start, s since 1970 or since midnight (None if unknown), and duration, s, of each run.
    """
    spans = [None if begin is None else station.span_of(begin, length) for begin, length in runs]
    during = [span for span in spans if span is not None and station.covers(span)]
    whole = (min(s[0] for s in during), max(s[1] for s in during)) if during else None
    air = tuple((name, text) for name in _AIR if (text := _air(station, name, whole)))
    return during, air, _clock_note(station, spans, during)


def _on_one_clock(logs: Sequence[Sequence[ChannelFacts]]) -> list[float]:
    """The first time of each log, s, if no two overlap, so that one clock continues through all; else empty."""
    clocks = [next((f.info for f in facts if f.state == "clock"), None) for facts in logs]
    spans = [clock.span for clock in clocks if clock is not None and not clock.recordings]
    if len(spans) < len(logs):
        return []
    order = sorted(spans)
    return [begin for begin, _ in spans] if all(a[1] <= b[0] for a, b in pairwise(order)) else []


def _length(facts: Sequence[ChannelFacts]) -> float:
    clock = next(f for f in facts if f.state == "clock")
    return clock.info.span[1] - clock.info.span[0]


def _first_moment(facts: Sequence[ChannelFacts]) -> float | None:
    begin = clock_zero(facts)
    return None if begin is None else begin + next(f for f in facts if f.state == "clock").info.span[0]


def _clock_note(
    station: StationLog, spans: Sequence[tuple[float, float] | None], during: Sequence[tuple[float, float]]
) -> str:
    if len(during) == len(spans):
        return ""
    why = "does not cover the times of day of all runs (other time zones?)"
    if None in spans:
        why = "cannot be compared with the clocks of the runs, which are not times of day"
    return f"the clock of {station.name} {why}, so that its wind is not used"


def _air(station: StationLog, name: str, span: tuple[float, float] | None) -> str:
    found = station.mean(name, span)
    if found is None:
        return ""
    unit, si_unit, digits = _AIR[name]
    column = station.columns[name]
    mean, spread = found
    if name in station.unstated:
        digits = max(digits, 1)
    else:
        mean, spread = (
            from_si(found[0], unit, si_unit),
            from_si(sum(found), unit, si_unit) - from_si(found[0], unit, si_unit),
        )
    least = 10.0**-digits
    comment = f"mean of '{column}' of {station.name}" + (" during the runs" if span else ", whole file")
    value = f"{mean:.{digits}f} +- {max(spread, least):.{digits}f}"
    if re.match(REDUCED, column, re.IGNORECASE):
        comment += "; check that it is not reduced to sea level"
    if name in station.unstated:
        return f'"{value} ?"  # {comment}; the file states no unit: write it for the ?'
    return f"{value} {unit}  # {comment}"


def _add_temperatures(
    keys: list[list[str]], station: StationLog, spans: Sequence[tuple[float, float]], read: Collection[str]
) -> None:
    means = [station.mean("temperature", span) for span in spans]
    values = [m[0] for m in means if m is not None]
    if (
        "temperature" in read
        and "temperature" not in station.unstated
        and len(values) == len(keys)
        and max(values) - min(values) > _ALIKE
    ):
        for own, value in zip(keys, values, strict=True):
            own.append(f"temperature: {from_si(value, 'degC', 'K'):.1f} degC")


def _add_winds(
    keys: list[list[str]],
    station: StationLog,
    spans: Sequence[tuple[float, float]],
    ways: Sequence[LoggedDirection],
    read: Collection[str],
) -> str:
    """Add the wind of each run to its keys; a note on its source, or why it is unknown."""
    if "wind_speed" not in read:
        return ""
    bearings = [way.bearing for way in ways if way.bearing is not None]
    if len(bearings) < len(keys):
        mean = station.mean("wind_speed", (spans[0][0], spans[-1][1]))
        unit = "in its unit" if "wind_speed" in station.unstated else "m/s"
        wind = "" if mean is None else f"mean wind {mean[0]:.1f} {unit}; "
        lack = f"{len(keys) - len(bearings)} of {len(keys)} logs have no heading"
        unknown = f"its direction along the road is unknown, since {lack}"
        return f"{station.name}: {wind}{unknown}; log the heading, or state wind_speed of each run"
    winds = [station.wind(bearing, span) for bearing, span in zip(bearings, spans, strict=True)]
    template = '{}: "{:.2f} ?"' if "wind_speed" in station.unstated else "{}: {:.2f} m/s"
    for own, one in zip(keys, winds, strict=True):
        if one is not None:
            own += [template.format("wind_speed", one[0]), template.format("crosswind", one[1])]
    if any(wind is None for wind in winds):
        return f"{station.name} states no wind speed and direction during some runs"
    return f"wind_speed (against the motion) and crosswind: means of {station.name} during each run"
