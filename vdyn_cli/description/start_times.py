"""Starts of runs written as times of day, as in a test day's log book."""

from __future__ import annotations

import re
from typing import Any

from pydantic_core import PydanticCustomError

_TIME_OF_DAY = re.compile(r"\s*([01]?\d|2[0-3]):([0-5]\d)(?::([0-5]\d(?:\.\d+)?))?\s*")
_DAY = 86400.0  # s


def seconds_after_first(runs: Any) -> Any:
    """The runs of a description with ``start`` in seconds after the first, where it is a time of day.

    A day ends between two runs where the difference is beyond half a day.

    Parameters
    ----------
    runs : as read from YAML, before any check; what is no list of mappings is returned as it is.

    Raises
    ------
    PydanticCustomError : some starts are times of day and others are not.
    """
    stated = [run for run in runs if isinstance(run, dict) and "start" in run] if isinstance(runs, list) else []
    moments = [_moment(run["start"]) for run in stated]
    times = [m for m in moments if m is not None]
    if not times:
        return runs
    if len(times) < len(runs):
        what = "'start' is a time of day in {some} of {all} runs. Write it so in all, or in seconds after the first run"
        raise PydanticCustomError("start", what, {"some": len(times), "all": len(runs)})
    return [{**run, "start": _wrapped(time - times[0])} for run, time in zip(runs, times, strict=True)]


def _moment(start: Any) -> float | None:
    """Seconds since midnight of ``10:08`` or ``10:08:14.5``; None for anything else."""
    match = _TIME_OF_DAY.fullmatch(start) if isinstance(start, str) else None
    return None if match is None else 3600.0 * int(match[1]) + 60.0 * int(match[2]) + float(match[3] or 0.0)


def _wrapped(difference: float) -> float:
    return (difference + 0.5 * _DAY) % _DAY - 0.5 * _DAY
