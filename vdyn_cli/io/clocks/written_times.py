"""Times of day, with or without a date, that loggers write as text, converted to seconds."""

from __future__ import annotations

import math
import re
import unicodedata
import warnings
from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array

_LONGEST_TIME = 48  # characters: a date with its weekday, a time with nanoseconds and its zone
_DAY, _HOUR = 86400.0, 3600.0  # s
_LONGEST_DAY = 30 * _DAY  # s since midnight; a later time counts from 1970
_CHUNK = 100_000
_LONGEST_STEP = 1.0  # s; a clock in s with longer steps may skip 60 to 99
_MOST_STEPS = 5.0  # median steps, largest step at a full minute or hour
_PLACE = r"[A-Z][A-Za-z]+(?:/[A-Z][A-Za-z_]+)+"  # Europe/Berlin
# Z, CEST, UTC+2, +02:00, +02:00[Europe/Berlin]
_ZONE = rf"\s*(?:Z|(?:[A-Z]{{3,5}})?(?:[+-]\d{{1,2}}(?::?\d{{2}})?)?(?:\[{_PLACE}\])?|{_PLACE})"
_BLANK = r"(?:\s|\u202f|\xe2\x80\xaf)*"  # also the narrow blank before AM and PM, as cells in Latin-1 show it
_HALF = r"[AaPp](?:\.?\s?[Mm]\.?)?(?![A-Za-z])"  # AM, p.m., a; no zone such as AEST
_DATE = (
    r"\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/.]\d{1,2}[-/.]\d{2,4}|\d{1,2}[- ][^\d\s:;,-]{3,12}[- ]\d{2,4}|\d+ days?"
)
# Without seconds only after a date or before AM or PM: 10:23 alone may be minutes and seconds.
_INSTANT = re.compile(
    rf"(?:({_DATE})(?:,?[ T]+|[-_]))?"
    rf"(\d{{1,2}}):(\d{{2}})(?::(\d{{2}}(?:[.,:]\d+)?)|(?=\s*{_HALF})|(?<=[ T]\d:\d{{2}})|(?<=[ T]\d{{2}}:\d{{2}}))"
    rf"{_BLANK}({_HALF})?" + _ZONE
)
# Tue Mar 04 09:12:05 GMT+01:00 2025, as programs in Java and C write it
_YEAR_LAST = re.compile(
    r"[A-Z][a-z]{2} ([A-Z][a-z]{2}) +(\d{1,2}) (\d{2}:\d{2}:\d{2}(?:\.\d+)?) "
    r"(?:[A-Z]{2,5}(?:[+-]\d{2}:\d{2})? )?(\d{4})"
)
# The first letters of months by which other languages differ from English, without accents.
_MONTHS = {
    **{"ene": "Jan", "gen": "Jan", "fev": "Feb", "mrz": "Mar", "avr": "Apr", "abr": "Apr", "mai": "May", "mag": "May"},
    **{"juin": "Jun", "giu": "Jun", "juil": "Jul", "lug": "Jul", "aou": "Aug", "ago": "Aug", "set": "Sep"},
    **{"okt": "Oct", "out": "Oct", "ott": "Oct", "dez": "Dec", "dic": "Dec"},
}
# 20260501T102311.5, 2026_05_01_10_23_11_500
_COMPACT = re.compile(
    r"(\d{4})[_-]?([01]\d)[_-]?([0-3]\d)[ T_-]([0-2]\d)[_:-]?([0-5]\d)[_:-]?([0-6]\d)(?:[.,_-](\d+))?" + _ZONE
)
_MINUTES = re.compile(r"(\d{1,4}):([0-5]?\d[.,]\d+)")  # minutes and fractional seconds; hours:minutes has no fraction
_START = re.compile(r"begin|(?<![a-z])(start|recorded|d.{1,2}but|inicio|inizio)", re.IGNORECASE)
_IN_DIGITS = re.compile("hhmmss", re.IGNORECASE)  # in a column's name
_DAY_ALONE = re.compile(_DATE)
_DAY_OR_MINUTE = re.compile(rf"{_DATE}|\d{{1,2}}:\d{{2}}")

FORMS = (
    "seconds, or times such as 10:23:11.5, 2026-05-01 10:23:11.5 or 01-May-2026 10:23:11.5, months in English, German, "
    "French, Spanish, Italian or Portuguese"
)


def is_instant(cell: str) -> bool:
    """Whether a cell is a time: ``10:23:11.5``, ``2026-05-01 10:23``, ``0 days 10:23:11.5``, minutes ``83:11.5``,
    ``20260501T102311.5``."""
    plain = cell.strip() if len(cell) <= _LONGEST_TIME else ""
    forms = (_INSTANT, _MINUTES, _YEAR_LAST, _COMPACT) if ":" in plain else (_COMPACT,)
    return any(form.fullmatch(plain) for form in forms)


def stated_start(lines: Sequence[str]) -> float:
    """The start of a recording in lines such as ``Startzeit: 10:01:38``, s since midnight, or since 1970 with a date.

    NaN where no line states one, or several state different ones.
    """
    words = (_START.search(line) for line in lines)
    found = (_INSTANT.search(word.string, word.end()) for word in words if word)
    starts = {float(written_seconds(np.array([one[0]], dtype=object))[0]) for one in found if one}
    return starts.pop() if len(starts) == 1 else math.nan


def is_day(cell: str) -> bool:
    """Whether a cell is only a date, as in a column of dates beside one of times of day."""
    return len(cell) <= _LONGEST_TIME and _DAY_ALONE.fullmatch(cell.strip()) is not None


def is_day_or_minute(cell: str) -> bool:
    """Whether a cell is only a date, or only hours and minutes: part of a time, not a name."""
    return len(cell) <= _LONGEST_TIME and _DAY_OR_MINUTE.fullmatch(cell.strip()) is not None


def written_seconds(cells: NDArray[np.object_]) -> Array:
    """Times of day in text cells, in seconds since midnight, or since 1970 if they state a date.

    Parameters
    ----------
    cells : (n,) text; other objects where the cell is empty.

    Returns
    -------
    (n,) s, NaN where a cell is not a time. Time zones are ignored: a log has only one.
    """
    import pandas as pd

    text = pd.Series(cells, dtype=object).str.strip()
    text = text.str.replace(f"^{_YEAR_LAST.pattern}$", r"\2-\1-\4 \3", regex=True)
    with_marks = "{0[1]}-{0[2]}-{0[3]} {0[4]}:{0[5]}:{0[6]}"
    text = text.str.replace(_COMPACT, lambda found: f"{with_marks.format(found)}.{found[7] or 0}", regex=True)
    parts = text.str.extract(f"^{_INSTANT.pattern}$")
    hours, minutes = (pd.to_numeric(parts[i], errors="coerce").to_numpy(float) for i in (1, 2))
    seconds = pd.to_numeric(parts[3].str.replace("[,:]", ".", regex=True), errors="coerce").fillna(0.0).to_numpy(float)
    half = parts[4].str.lower().str.replace(r"[\s.]", "", regex=True)
    hours = np.where(half.notna(), hours % 12 + 12 * half.isin(["p", "pm"]), hours)
    counted: Array = _days(parts[0]) * _DAY + 3600.0 * hours + 60.0 * minutes + seconds
    if np.isnan(counted).any():
        short = text.str.extract(f"^{_MINUTES.pattern}$")
        first, last = (pd.to_numeric(short[i].str.replace(",", "."), errors="coerce").to_numpy(float) for i in (0, 1))
        counted = np.where(np.isnan(counted), 60.0 * first + last, counted)
    return counted


def seconds_of_digits(values: Array, name: str) -> Array | None:
    """Seconds since midnight of a clock (n,) written in digits, ``hhmmss.ss``; None for any other column.

    Such a clock jumps by an additional 40 at each full minute, from 59.95 to 100.00, and only there. In a log without a
    full minute, or that lacks samples there, only the column's name shows it, such as ``Time (HHMMSS.SS)``.
    """
    for first in range(0, values.size, _CHUNK):  # a clock in s returns here after a minute
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
    largest = np.max(steps[full], initial=0.0)
    if not _IN_DIGITS.search(name) and (not full.size or usual > _LONGEST_STEP or largest > _MOST_STEPS * usual):
        return None
    found = np.full(values.shape, np.nan)
    found[written] = counted
    return found


def _days(dates: object) -> Array:
    """Days since 1970 of dates; 0 where there is none, NaN where the date is impossible.

    A date such as 03/07/2026 has the day first, unless the dates of the log are closer together with the month first.
    """
    import pandas as pd

    series = pd.Series(dates, dtype=object)
    written = list(series.dropna().unique())  # few: one per day
    orders = [{date: _day(date, day_first) for date in written} for day_first in (True, False)]
    spans = [np.ptp(list(order.values())) if order else 0.0 for order in orders]
    return series.map(orders[int(spans[1] < spans[0])]).where(series.notna(), 0.0).to_numpy(float)


def _day(date: str, day_first: bool) -> float:
    """Days since 1970 of a date; NaN if it is impossible."""
    import pandas as pd

    if "day" in date:
        return float(date.split()[0])
    try:
        with warnings.catch_warnings(action="ignore"):  # of a day above 12 in the place of a month
            day = pd.to_datetime(_with_english_month(date), dayfirst=day_first and not date[:4].isdigit())
    except ValueError:
        return float("nan")
    return float(day.value // (10**9 * 86400))


def _with_english_month(date: str) -> str:
    """A date such as ``01-Mai-2026`` or ``1 août 2026`` with its month in English; other dates unchanged."""
    parts = re.split("([- ])", date)
    if len(parts) != 5 or parts[2].isdigit():
        return date
    with suppress(UnicodeError):  # cells are read as Latin-1 in any encoding
        parts[2] = parts[2].encode("latin-1").decode("utf-8")
    letters = unicodedata.normalize("NFKD", parts[2].lower()).encode("ascii", "ignore").decode()
    month = next((name for begin, name in _MONTHS.items() if letters.startswith(begin)), letters[:3])
    return "".join([*parts[:2], month, *parts[3:]])


def time_between(first: float, second: float) -> float:
    """Time from ``first`` to ``second``, s; for times of day without a date, the value within half a day."""
    if min(first, second) > _LONGEST_DAY:
        return second - first
    return (second - first + 0.5 * _DAY) % _DAY - 0.5 * _DAY


def since_first(seconds: Array) -> Array:
    """Times (n,) in s since the first of them; a decrease by more than half a day is taken as midnight, one from 12:59
    to 1:00 as the hour after noon of a clock of 12 hours, and one of minutes and seconds, 59:59.9 to 00:00.0, or of an
    hour at a full hour (the end of summer time), as a full hour if the time goes on without a pause.
    """
    written = np.flatnonzero(np.isfinite(seconds))
    if not written.size:
        return seconds
    at = seconds[written]
    nights = np.cumsum(np.diff(at, prepend=at[0]) < -_DAY / 2)
    past_noon = (at[:-1] >= 12.98 * 3600.0) & (at[:-1] < 13.0 * 3600.0) & (np.abs(at[1:] - 3630.0) <= 30.0)
    halves = np.cumsum(np.r_[False, past_noon])
    counted = np.full(seconds.shape, np.nan)
    counted[written] = at + _DAY * nights + 0.5 * _DAY * halves + _HOUR * _full_hours(at) - at[0]
    return counted


def _full_hours(at: Array) -> Array:
    """The full hours (n,) that a clock of minutes and seconds (n,), s, has passed, or by which one of a time of day
    (n,), s, was set back at the end of summer time; 0 for any other clock."""
    steps = np.diff(at, prepend=at[0])
    if at.size < 3 or not steps.min() < -0.5 * _HOUR:
        return np.zeros(at.size)
    longest = _MOST_STEPS * np.median(steps[1:])
    back = (steps < 0.0) & (np.abs(steps + _HOUR) <= longest)
    if at.min() >= 0.0 and at.max() < _HOUR:
        return np.cumsum((steps < 0.0) & (steps + _HOUR <= longest))
    back &= (at % _HOUR <= longest) & (np.count_nonzero(back) == 1)
    return np.cumsum(back)


def past_midnight(seconds: Array) -> Array:
    """A clock (n,) of s since midnight that goes on at 0 after 86400 without a pause, without that decrease."""
    written = np.flatnonzero(np.isfinite(seconds))
    at = seconds[written]
    steps = np.diff(at, prepend=at[:1])
    night = steps < -_DAY / 2
    if np.count_nonzero(night) != 1 or at.min() < 0.0 or at.max() > _DAY:
        return seconds
    if float((steps + _DAY)[night][0]) > _MOST_STEPS * np.median(steps[1:]):
        return seconds
    counted = seconds.copy()
    counted[written] += _DAY * np.cumsum(night)
    return counted
