"""Tables of split times: the instants at which a vehicle passed given speeds, without samples in between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Array, Rows
from vdyn_cli.quantities.errors import Finding


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
