"""Times of day, with or without a date, as loggers write them in text, and the seconds that they count."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array

_LONGEST = 48  # characters: a date with its weekday, a time with nanoseconds and its zone
_DAY = 86400.0  # s
_CHUNK = 100_000
_LONGEST_STEP = 1.0  # s; a clock in s with longer steps may pass over 60 to 99
_MOST_STEPS = 5.0  # usual steps of a clock over a full minute
_ZONE = r"\s*(?:Z|UTC|GMT|[+-]\d{2}:?\d{2})?"
_DATE = r"\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/.]\d{1,2}[-/.]\d{2,4}|\d{1,2}[- ][A-Za-z]{3,9}[- ]\d{2,4}|\d+ days?"
# Without seconds only behind a date or before AM and PM: 10:23 alone may be minutes and seconds.
_INSTANT = re.compile(
    rf"(?:({_DATE})[ T]+)?"
    r"(\d{1,2}):(\d{2})(?::(\d{2}(?:[.,:]\d+)?)|(?=\s*[AaPp][Mm])|(?<=[ T]\d:\d{2})|(?<=[ T]\d{2}:\d{2}))"
    r"\s*([AaPp][Mm])?" + _ZONE
)
_MINUTES = re.compile(r"(\d{1,4}):([0-5]?\d[.,]\d+)")  # and seconds with their fraction, which hours and minutes lack
_DAY_OR_MINUTE = re.compile(rf"{_DATE}|\d{{1,2}}:\d{{2}}")


def is_instant(cell: str) -> bool:
    """Whether a cell is a time: ``10:23:11.5``, ``2026-05-01 10:23``, ``0 days 10:23:11.5``, minutes ``83:11.5``."""
    plain = cell.strip() if len(cell) <= _LONGEST and ":" in cell else ""
    return _INSTANT.fullmatch(plain) is not None or _MINUTES.fullmatch(plain) is not None


def is_day_or_minute(cell: str) -> bool:
    """Whether a cell is a date alone, or hours and minutes alone: part of a time, and no name."""
    return len(cell) <= _LONGEST and _DAY_OR_MINUTE.fullmatch(cell.strip()) is not None


def written_seconds(cells: NDArray[np.object_]) -> Array:
    """Seconds that cells of text count: since the begin of their day, or since 1970 where they state a date.

    Parameters
    ----------
    cells : (n,) text, or anything else where nothing is written.

    Returns
    -------
    (n,) s, NaN where a cell is no such time. Zones are not applied: a log has one.
    """
    import pandas as pd

    parts = pd.Series(cells, dtype=object).str.strip().str.extract(f"^{_INSTANT.pattern}$")
    hours, minutes = (pd.to_numeric(parts[i], errors="coerce").to_numpy(float) for i in (1, 2))
    seconds = pd.to_numeric(parts[3].str.replace("[,:]", ".", regex=True), errors="coerce").fillna(0.0).to_numpy(float)
    half = parts[4].str.lower()
    hours = np.where(half.notna(), hours % 12 + 12 * (half == "pm"), hours)
    counted: Array = _days(parts[0]) * _DAY + 3600.0 * hours + 60.0 * minutes + seconds
    if np.isnan(counted).any():
        short = pd.Series(cells, dtype=object).str.strip().str.extract(f"^{_MINUTES.pattern}$")
        first, last = (pd.to_numeric(short[i].str.replace(",", "."), errors="coerce").to_numpy(float) for i in (0, 1))
        counted = np.where(np.isnan(counted), 60.0 * first + last, counted)
    return counted


def seconds_of_digits(values: Array) -> Array | None:
    """Seconds since midnight of a clock (n,) that is written in digits, ``hhmmss.ss``; None of any other.

    Such a clock jumps by 40 s more at each full minute, from 59.95 to 100.00, and no other does so there alone.
    """
    for first in range(0, values.size, _CHUNK):  # a clock in s ends this after a minute
        if (values[first : first + _CHUNK] % 100.0 >= 60.0).any():
            return None
    written = np.flatnonzero(np.isfinite(values))
    digits = values[written]
    hours, rest = np.divmod(digits, 10_000.0)
    minutes, seconds = np.divmod(rest, 100.0)
    if digits.size < 2 or not ((hours >= 0.0) & (hours < 24.0) & (minutes < 60.0) & (seconds < 60.0)).all():
        return None
    counted = 3600.0 * hours + 60.0 * minutes + seconds
    full = np.flatnonzero(np.diff(np.floor(digits / 100.0)) != 0.0)
    steps = np.diff(since_first(counted))
    usual = float(np.median(steps))
    if not full.size or usual > _LONGEST_STEP or np.max(steps[full]) > _MOST_STEPS * usual:
        return None
    found = np.full(values.shape, np.nan)
    found[written] = counted
    return found


def _days(dates: object) -> Array:
    """Days since 1970 of dates, 0 where there is none, NaN where there is no such day."""
    import pandas as pd

    series = pd.Series(dates, dtype=object)
    days = {}
    for date in series.dropna().unique():  # few: one a day
        if "day" in date:
            days[date] = float(date.split()[0])
            continue
        try:
            day = pd.to_datetime(date, dayfirst=not date[:4].isdigit())
        except ValueError:
            days[date] = np.nan
        else:
            days[date] = float(day.value // (10**9 * 86400))
    return series.map(days).where(series.notna(), 0.0).to_numpy(float)


def since_first(seconds: Array) -> Array:
    """Times (n,) in s from the first of them; one that falls by more than half a day has passed midnight."""
    written = np.flatnonzero(np.isfinite(seconds))
    if not written.size:
        return seconds
    at = seconds[written]
    nights = np.cumsum(np.diff(at, prepend=at[0]) < -_DAY / 2)
    counted = np.full(seconds.shape, np.nan)
    counted[written] = at + _DAY * nights - at[0]
    return counted
