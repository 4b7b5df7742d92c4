"""Tables of split times: the instants at which a vehicle passed given speeds, without samples in between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.io.reader import Recorded
from vdyn_cli.quantities.arrays import Array, Rows
from vdyn_cli.quantities.errors import Finding

MOST_LEVELS = 100  # rows of a table of split times: those of regulations have 5 to 30, a log has more
_FEWEST_LEVELS = 3
_SPEED_UNITS = ("", "km/h", "mph", "m/s", "kph", "kmh")


@dataclass(frozen=True)
class SplitTable:
    """The columns of a table of elapsed split times: the speed levels, and the times of each run."""

    levels: str
    unit: str
    times: tuple[str, ...]


def split_table(columns: Sequence[Recorded]) -> SplitTable | None:
    """The table, if the first column falls in equal steps and each of the others, two or more, rises like a clock."""
    numbers = [(c.info, c.values) for c in columns if c.values is not None]
    if len(numbers) < 3 or not _FEWEST_LEVELS <= numbers[0][1].size <= MOST_LEVELS:
        return None
    (first, levels), others = numbers[0], numbers[1:]
    steps = np.diff(levels)
    equal = bool((steps < 0.0).all() and np.ptp(steps) <= 1e-6 * abs(steps[0]))
    if first.unit not in _SPEED_UNITS or not equal:
        return None
    for info, values in others:
        times = values[np.isfinite(values)]
        if info.unit not in ("", "s") or times.size < 2 or times[0] < 0.0 or not (np.diff(times) > 0.0).all():
            return None
    return SplitTable(first.name, first.unit, tuple(info.name for info, _ in others))


@dataclass(frozen=True)
class SplitInstants:
    """The rows of a table in order of time, their times (n,) in the unit of the table, and errors."""

    rows: Rows
    time: Array
    problems: tuple[Finding, ...] = ()


def split_instants(times: Array, how: str, place: str) -> SplitInstants:
    """The instants of a table of split times.

    Parameters
    ----------
    times : (n,) one for each speed level, NaN for a level that was not passed.
    how : ``elapsed``: time since the first level; ``intervals``: time from the level of the previous row to that of
        this row, empty or zero in the first row of a run.
    place : file and column, for messages.
    """
    written = np.flatnonzero(np.isfinite(times))
    if how == "elapsed":
        rows = written[np.argsort(times[written], kind="stable")]
        return SplitInstants(rows, times[rows])
    if written.size == 0:
        return SplitInstants(written, times[written])
    first = int(written[0]) if times[written[0]] == 0.0 else max(int(written[0]) - 1, 0)
    rows = np.arange(first, int(written[-1]) + 1, dtype=np.intp)
    steps = np.concatenate([[0.0], times[rows[1:]]])
    problems: list[Finding] = []
    if written[0] == 0 and times[0] > 0.0:
        what = "the first level has an interval, but there is no level above it"
        problems.append(Finding(place, what, f"{times[0]:g}", "leave its cell empty, or add the level above"))
    missing = np.flatnonzero(~np.isfinite(steps))
    if missing.size:
        what = f"an interval is missing in row {rows[missing[0]] + 1} of the table, so that later instants are unknown"
        problems.append(Finding(place, what, remedy="end the column there, or write elapsed times"))
    return SplitInstants(rows, np.cumsum(np.nan_to_num(steps)), tuple(problems))
