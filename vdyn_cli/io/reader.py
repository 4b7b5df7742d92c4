"""The contract of a reader of logs: it only parses; quality checks, units and signs are the same for all formats."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol, runtime_checkable

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import to_si

_CLOCK = re.compile(
    r"((elapsed|log|sample|device|gps|system|recording)[ _]?time|time|"
    r"(seconds[ _])?elapsed(?=\W*$|[ _]*[\[(]|[ _]m?s\b)|"
    r"(\w+[ _.])?time[ _]?stamps?|zeit|x_value|t(?=_m?s\b|[^\w]|$))(?![a-z])",
    re.IGNORECASE,
)
# Rates, Hz, that loggers of road tests have: a unit of time is decided where only one gives such a rate.
_RATES = (0.5, 5_000.0)
_SERIAL = (20_000.0, 80_000.0)  # days since 1900 as spreadsheets count them: the years 1954 to 2119
_UNIX = (9e8, 4e9)  # s since 1970: the years 1998 to 2096
_TIME_UNITS = frozenset(["s", "sec", "secs", "second", "seconds", "ms", "msec", "us", "usec", "min"])


@dataclass(frozen=True)
class Column:
    """Where a channel stands in a file.

    Parameters
    ----------
    column : its name in the file; ``Name#2`` is the second of several of that name.
    unit, si_unit : unit in the file, and the SI unit that the channel has inside.
    sign : -1 where the logger's convention is the opposite.
    optional : a missing or empty column is left out rather than refused.
    where : file and line of the description that requests it.
    group, source : the group of channels, or the device, where the file has several channels of this name; the group
        of the channel ``time`` is the one whose clock the log gets.
    scale : factor of the file's values that corrects the sensor's gain.
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

    def in_si(self, values: Array) -> Array:
        """Values (n,) of the file in SI, times ``scale``, with the sign of our convention."""
        converted = to_si(values, self.unit, self.si_unit)
        if self.scale != 1.0:
            converted = self.scale * converted
        return -converted if self.sign < 0 else converted


@dataclass(frozen=True)
class ReadOptions:
    """How a log is written, where guessing is not wanted.

    Parameters
    ----------
    delimiter : ``;``, ``,``, ``|``, ``tab``, ``space`` (any run of blanks); guessed where None.
    decimal : decimal mark; guessed where None.
    encoding : such as utf-8, cp1252, utf-16; guessed where None.
    clock : ``strict`` refuses a clock that does not rise, ``drop`` leaves out the rows that do not rise.
    header_row : line of the column names, counted from 1; searched where None.
    split_times : the log is a table of speed levels and split times, ``elapsed`` or ``intervals``; a log where None.
    split_runs : whether each run of such a table is a column or a row.
    levels : m/s, groups of successive speed levels, of a coast-down report that does not state its own.
    """

    delimiter: str | None = None
    decimal: Literal[".", ","] | None = None
    encoding: str | None = None
    clock: Literal["strict", "drop"] = "strict"
    header_row: int | None = None
    split_times: Literal["elapsed", "intervals"] | None = None
    split_runs: Literal["columns", "rows"] = "columns"
    levels: Sequence[Sequence[float]] = ()


@dataclass(frozen=True)
class ChannelInfo:
    """A channel that a file holds.

    Parameters
    ----------
    name, unit : as the file writes them; the unit is empty where the file states none.
    rate : written samples per second, NaN where the clock is not known.
    span : first and last time at which it is written, s; NaN where the clock is not known.
    group, source : the group and the device that the file names for it; empty where it names none.
    begin : of a clock of times of day, when it counts zero: s since 1970, or since midnight where no date is stated;
        NaN of all others.
    """

    name: str
    unit: str
    rate: float
    span: tuple[float, float]
    group: str = ""
    source: str = ""
    begin: float = math.nan


@dataclass(frozen=True, eq=False)
class Recorded:
    """A channel of a file with its samples.

    Parameters
    ----------
    info : its name, unit, rate and span.
    time : (n,) s, the clock of its samples; None where the file has none.
    values : (n,) in the unit of the file, NaN where nothing is written; None where it holds no numbers.
    """

    info: ChannelInfo
    time: Array | None
    values: Array | None


def channel_info(
    name: str, unit: str, time: Array | None, values: Array | None, group: str = "", source: str = ""
) -> ChannelInfo:
    """Rate and span of a channel from its samples (n,) and their times (n,), either None where it has none."""
    at = np.empty(0)
    if time is not None and values is not None and time.size == values.size:
        at = time[np.isfinite(values) & np.isfinite(time)]
    duration = float(at[-1] - at[0]) if at.size > 1 else 0.0
    rate = (at.size - 1) / duration if duration > 0 else math.nan
    span = (float(at[0]), float(at[-1])) if at.size else (math.nan, math.nan)
    return ChannelInfo(name, unit, rate, span, group, source)


def is_clock(name: str, unit: str = "") -> bool:
    """Whether a channel of a file may be its clock: it begins with a word such as time, t or Zeit, or counts seconds.

    Parameters
    ----------
    unit : that the file states for it; empty where only the name is to tell.
    """
    return _CLOCK.match(name) is not None or unit.lower() in _TIME_UNITS


def rises(time: Array) -> bool:
    """Whether the written values (n,) of a column never fall, and do not stand still, as a clock's."""
    steps = np.diff(time[np.isfinite(time)])
    return bool(steps.size and (steps >= 0.0).all() and (steps > 0.0).any())


def clock_units(rate: float, first: float = 0.0) -> list[str]:
    """The units of time in which a clock has a rate that loggers have.

    Parameters
    ----------
    rate : samples per unit of the clock.
    first : its first value, which decides between two units where in one of them it counts from 1970.
    """
    units = [u for u in ("s", "ms", "us", "ns") if _RATES[0] <= rate / to_si(1.0, u, "s") <= _RATES[1]]
    if not units and _SERIAL[0] <= first <= _SERIAL[1] and _RATES[0] <= rate / 86400.0 <= _RATES[1]:
        return ["day"]
    since_1970 = [u for u in units if _UNIX[0] <= to_si(first, u, "s") <= _UNIX[1]]
    return since_1970 or units


def has_usual_rate(time: Array, unit: str) -> bool:
    """Whether a column (n,) whose unit the file states, or does not (empty), may be a clock of a rate loggers have."""
    written = time[np.isfinite(time)]
    span = float(written[-1] - written[0]) if written.size else 0.0
    return bool(unit) or (span > 0.0 and bool(clock_units((written.size - 1) / span)))


@runtime_checkable
class Reader(Protocol):
    """A log format."""

    def matches(self, path: Path) -> bool:
        """Whether the file has this format, told from its name or its first bytes; False for a missing file."""

    def channels(self, path: Path) -> tuple[ChannelInfo, ...]:
        """The channels of a file, in its order.

        Raises
        ------
        InputError : the file cannot be read.
        """

    def read(self, path: Path, mapping: Mapping[str, Column], options: ReadOptions, name: str) -> Log:
        """The mapped channels as the file holds them: in its units and with its signs.

        Parameters
        ----------
        mapping : where each channel stands; ``time`` is among them.
        name : what the log is called in all findings.

        Returns
        -------
        Log : time in SI, each channel NaN where nothing is written, nothing interpolated or sorted; ``source`` says
            where the samples stand in the file, and holds the channels on other clocks than the log's.

        Raises
        ------
        InputError : with every problem of the file.
        """


@runtime_checkable
class Browsable(Protocol):
    """A reader that hands out every channel of a file without being asked for it by name."""

    def recordings(self, path: Path) -> Iterator[Recorded]:
        """Every channel with its samples, in the file's order.

        Raises
        ------
        InputError : the file cannot be read.
        """
