"""The contract of a log reader: it only parses; quality checks, units and signs are handled alike for all formats."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol, runtime_checkable

import numpy as np

from vdyn_cli.quantities.arrays import Array, Mask, spans
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import UnitError, to_si

_CLOCK = re.compile(
    r"_{0,2}("
    r"(elapsed|log|sample|device|gps|utc|local|system|recording|epoch|unix|posix|(log[ _]?)?mono(tonic)?)[ _]?time|"
    r"time([mun]s(?=\W*$))?|(gps[ _]?)?i?tow(?=\W*$|_[mun]?s\b)|epoch(?=\W*$|[ _]*[\[(]|[ _][mun]?s\b)|"
    r"(seconds[ _])?elapsed(?=\W*$|[ _]*[\[(]|[ _]m?s\b)|"
    r"(\w+[ _.])?time[ _]?stamps?|stamp(?=_[mun]?s\b)|date[ /_-]?time|"
    r"(uhr)?zeit(stempel|punkt)?|temps|tiempo|tempo|时间|時間|時刻|시간|время|"
    r"x_value|utc|(ms|seconds)_today|"
    r"(milli|micro)s(econds)?|(minutes|seconds|secs?|ms)(?=\W*$)|t(?=_[mun]?s\b|[^\w]|$)|t_?(gps|can|utc)(?=_[mun]?s\b|$))(?![a-z])",
    re.IGNORECASE,
)
# Sampling rates, Hz, of loggers in road tests: the unit of time is known if only one unit gives such a rate.
_RATES = (0.5, 5_000.0)
_RARE = 1e-3  # Hz, lowest rate of a clock that counts from 1970, such as a station's
# Of the rows of a damaged clock: receivers and phones write some fixes late or twice. A column with more is no clock.
MOST_LATE = 0.2
_RESTARTED = 10
_SERIAL = (20_000.0, 80_000.0)  # days since 1900 as spreadsheets count them: the years 1954 to 2119
_UNIX = (9e8, 4e9)  # s since 1970: the years 1998 to 2096
UnitFrom = Literal["file", "name", "rate"]
_TIME_UNITS = frozenset(["s", "sec", "secs", "second", "seconds", "ms", "msec", "us", "usec", "ns", "nsec", "min"])


@dataclass(frozen=True)
class Column:
    """The column of a file from which a channel is read.

    Parameters
    ----------
    column : its name in the file; ``Name#2`` is the second of several equal names.
    unit, si_unit : unit in the file, and the channel's SI unit.
    sign : -1 if the logger's sign convention is opposite to vdyn's.
    optional : omit a missing or empty column instead of refusing the log.
    where : file and line of the description that maps it.
    group, source : group of channels or device, if the file has several channels of this name; the log gets the clock
        of the group of the channel ``time``.
    scale : factor on the file's values that corrects the sensor's gain.
    of_run : the unit is stated for this run alone, and so has priority over the file's.
    """

    column: str
    unit: str
    si_unit: str
    sign: int = 1
    optional: bool = False
    where: str = ""
    group: str = ""
    source: str = ""
    scale: float = 1.0
    of_run: bool = False

    def in_si(self, values: Array) -> Array:
        """Values (n,) of the file in SI, times ``scale``, in vdyn's sign convention."""
        converted = to_si(values, self.unit, self.si_unit)
        if self.scale != 1.0:
            converted = self.scale * converted
        return -converted if self.sign < 0 else converted


COUNTED = Column("number of the row", "s", "s")  # the time of a log without a clock, but with a fixed rate


@dataclass(frozen=True)
class ReadOptions:
    """Format of a log where it is not to be guessed.

    Parameters
    ----------
    delimiter : ``;``, ``,``, ``|``, ``tab``, ``space`` (any run of blanks); None: guessed.
    decimal : decimal mark; None: guessed.
    encoding : such as utf-8, cp1252, utf-16; None: guessed.
    clock : ``strict`` refuses a clock that does not increase, ``drop`` omits the rows that do not increase.
    header_row : line of the column names, counted from 1; None: searched.
    split_times : the file is a table of speed levels and split times, ``elapsed`` or ``intervals``; None: it is a log.
    split_runs : whether each run of such a table is a column or a row.
    levels : m/s, groups of successive speed levels, for a coast-down report that does not state them.
    window : s, first and last time that is used: a channel without values elsewhere is not refused.
    rate : Hz, of a log without a column of time: ``time`` is not read from the file; None: it has a clock.
    recording : number of the recording in a file whose clock restarts, counted from 1; None: the file has one.
    """

    delimiter: str | None = None
    decimal: Literal[".", ","] | None = None
    encoding: str | None = None
    clock: Literal["strict", "drop"] = "strict"
    header_row: int | None = None
    split_times: Literal["elapsed", "intervals"] | None = None
    split_runs: Literal["columns", "rows"] = "columns"
    levels: Sequence[Sequence[float]] = ()
    window: tuple[float, float] = (-math.inf, math.inf)
    recording: int | None = None
    rate: float | None = None


@dataclass(frozen=True)
class ChannelInfo:
    """A channel of a file.

    Parameters
    ----------
    name, unit : as the file writes them; the unit is empty if the file states none.
    unit_from : source of the unit: the file, the name of a clock, or the rate that it gives a clock.
    rate : recorded samples per second; NaN if the clock is unknown.
    span : first and last time of its samples, s; NaN if the clock is unknown.
    group, source : its group and device in the file; empty if the file names none.
    begin : zero of a clock that was recorded as times of day: s since 1970, or since midnight if no date is stated;
        NaN for other channels.
    late : rows of a clock whose time is not after all times before.
    recordings : first and last time, s, of each recording in a file whose clock restarts; empty if it does not.
    """

    name: str
    unit: str
    rate: float
    span: tuple[float, float]
    group: str = ""
    source: str = ""
    begin: float = math.nan
    unit_from: UnitFrom = "file"
    late: int = 0
    recordings: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, eq=False)
class Recorded:
    """A channel of a file with its samples.

    Parameters
    ----------
    info : its name, unit, rate and span.
    time : (n,) s, times of its samples; None if the file has no clock.
    values : (n,) in the unit of the file, NaN where no value is recorded; None if it contains no numbers.
    """

    info: ChannelInfo
    time: Array | None
    values: Array | None


def channel_info(
    name: str, unit: str, time: Array | None, values: Array | None, group: str = "", source: str = ""
) -> ChannelInfo:
    """The ``ChannelInfo`` of a channel, with rate and span of its samples.

    rate = (m - 1) / (t_m - t_1), from the m times with a value; NaN for fewer than two

    Parameters
    ----------
    unit : as the file states it. time : (n,) s, or None. values : (n,), or None.
    group : of the channels with the same clock. source : of the channel in the vehicle, such as its control unit.
    """
    at = np.empty(0)
    if time is not None and values is not None and time.size == values.size:
        there = np.isfinite(values) & np.isfinite(time)
        at, value = time[there], values[there]
        written_twice = (at[1:] == at[:-1]) & (value[1:] == value[:-1])  # one sample in two rows
        at = at[np.r_[True, ~written_twice]] if written_twice.any() else at
    duration = float(at[-1] - at[0]) if at.size > 1 else 0.0
    rate = (at.size - 1) / duration if duration > 0 else math.nan
    span = (float(at[0]), float(at[-1])) if at.size else (math.nan, math.nan)
    return ChannelInfo(name, unit, rate, span, group, source)


def is_clock(name: str, unit: str = "") -> bool:
    """Whether a channel of a file may be its clock, by a name such as time, t, Zeit, or by a unit of time.

    Parameters
    ----------
    unit : stated by the file; empty: judge by the name alone.
    """
    return _CLOCK.match(name) is not None or unit.lower() in _TIME_UNITS


def rises(time: Array) -> bool:
    """Whether the recorded values (n,) of a column never decrease and do increase, like a clock."""
    steps = np.diff(time[np.isfinite(time)])
    return bool(steps.size and (steps >= 0.0).all() and (steps > 0.0).any())


def late_rows(time: Array) -> Mask:
    """The rows (n,) whose time is recorded, but not after all times before; as `reading: {clock: drop}` leaves out."""
    known = np.where(np.isfinite(time), time, -np.inf)
    late = np.zeros(time.size, dtype=bool)
    late[1:] = known[1:] <= np.maximum.accumulate(known)[:-1]
    return np.asarray(late & np.isfinite(time))


def rises_but_for(time: Array) -> int:
    """The number of late rows of a clock (n,) if at most ``MOST_LATE`` of them are, so that it is damaged; else 0.

    ``_RESTARTED`` late rows one after another are another recording, as after an overflow of the clock.
    """
    late = late_rows(time)
    count = int(np.count_nonzero(late))
    isolated = all(stop - first < _RESTARTED for first, stop in spans(late))
    return count if isolated and count <= MOST_LATE * time.size else 0


def clock_units(rate: float, first: float = 0.0) -> list[str]:
    """The units of time in which a clock has a rate that is usual for loggers, ``_RATES`` in Hz.

    Parameters
    ----------
    rate : samples per unit of the clock.
    first : its first value; if it is a date since 1970 in one of several possible units, only that unit is returned.
    """
    units = [u for u in ("s", "ms", "us", "ns") if _RATES[0] <= rate / to_si(1.0, u, "s") <= _RATES[1]]
    if not units and _SERIAL[0] <= first <= _SERIAL[1] and _RATES[0] <= rate / 86400.0 <= _RATES[1]:
        return ["day"]
    return since_1970(rate, first) or units


def since_1970(rate: float, first: float) -> list[str]:
    """The unit in which a clock's first value is a date and its rate not absurdly low; empty if there is none.

    Parameters
    ----------
    rate : samples per unit of the clock. first : its first value, a date from ``_UNIX[0]`` to ``_UNIX[1]`` s since
        1970.
    """
    dates = [u for u in ("s", "ms", "us", "ns") if _UNIX[0] <= to_si(first, u, "s") <= _UNIX[1]]
    return [u for u in dates if _RARE <= rate / to_si(1.0, u, "s") <= _RATES[1]]


def clock_seconds(time: Array, unit: str) -> Array:
    """The times (n,) of a clock in s; unchanged if its unit is empty or not one of time."""
    try:
        return to_si(time, unit or "s", "s")
    except UnitError:
        return time


def has_usual_rate(time: Array, unit: str) -> bool:
    """Whether a column (n,) may be a clock: it has a unit, or a rate that is usual for loggers in some unit of time."""
    written = time[np.isfinite(time)]
    span = float(written[-1] - written[0]) if written.size else 0.0
    return bool(unit) or (span > 0.0 and bool(clock_units((written.size - 1) / span)))


@runtime_checkable
class Reader(Protocol):
    """A log format."""

    def matches(self, path: Path) -> bool:
        """Whether the file has this format, by its name or its first bytes; False for a missing file."""

    def channels(self, path: Path) -> tuple[ChannelInfo, ...]:
        """The channels of a file, in its order.

        Raises
        ------
        InputError : the file cannot be read.
        """

    def read(self, path: Path, mapping: Mapping[str, Column], options: ReadOptions, name: str) -> Log:
        """The mapped channels as recorded: in the file's units and sign convention.

        Parameters
        ----------
        mapping : the column of each channel, ``time`` included.
        options : format of the file where it is not to be guessed.
        name : name of the log in all findings.

        Returns
        -------
        Log : time in SI; channels are NaN where no value is recorded, and not interpolated or sorted; ``source`` gives
            the samples' lines in the file, and the channels on other clocks.

        Raises
        ------
        InputError : with all problems of the file.
        """


@runtime_checkable
class Selective(Protocol):
    """A reader that can read some of the channels of a file without reading the others."""

    def selected(self, path: Path, only: Callable[[str], bool]) -> Iterator[Recorded]:
        """Every channel in the file's order, the samples only of clocks and of those for whose name ``only`` is true.

        Raises
        ------
        InputError : the file cannot be read.
        """


@runtime_checkable
class Browsable(Protocol):
    """A reader that can list every channel of a file with its samples."""

    def recordings(self, path: Path) -> Iterator[Recorded]:
        """Every channel with its samples, in the file's order.

        Raises
        ------
        InputError : the file cannot be read.
        """
