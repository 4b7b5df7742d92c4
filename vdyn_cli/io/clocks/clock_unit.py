"""The unit of a clock: stated by the file, by the end or beginning of its name, or the only one with a usual rate."""

from __future__ import annotations

import re

import numpy as np

from vdyn_cli.io.reader import UnitFrom, clock_units
from vdyn_cli.quantities.arrays import Array

_WORDS = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("minute", "minutes"), "min"),
    **dict.fromkeys(("itow", "ms", "msec", "msecs", "millis", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("us", "usec", "usecs", "micros", "microsecond", "microseconds"), "us"),
    **dict.fromkeys(("ns", "nsec", "nsecs", "nanos", "nanosecond", "nanoseconds"), "ns"),
}
_BREAK = re.compile(r"[\W_]+|(?<=[a-z]{2})(?=[A-Z])")  # TimeUS, but not iTOW, ms of the GPS week


def unit_of_name(name: str) -> str:
    """The unit of time in a clock's name, such as ms of ``time_ms``, ``timestampMs`` and ``ms_today``; else empty."""
    words = [word.lower() for word in _BREAK.split(name) if word]
    ends = (words[-1], words[0]) if words else ()
    return next((_WORDS[word] for word in ends if word in _WORDS), "")


def clock_unit(name: str, stated: str, time: Array) -> tuple[str, UnitFrom]:
    """The unit of a clock and its source; an empty unit if several give a usual rate, or none does.

    Parameters
    ----------
    stated : by the file; empty if it states none. time : (n,) its values in the file.
    """
    if stated:
        return stated, "file"
    if unit := unit_of_name(name):
        return unit, "name"
    written = time[np.isfinite(time)]
    span = float(written[-1] - written[0]) if written.size > 1 else 0.0
    units = clock_units((written.size - 1) / span, float(written[0])) if span > 0.0 else []
    return (units[0], "rate") if len(units) == 1 else ("", "file")
