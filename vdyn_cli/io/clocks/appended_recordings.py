"""Files with several recordings, one after another: where the clock restarts, and the rows of one recording."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, InputError

_SHORTEST_RECORDING = 10  # rows
_RETURNS = 0.1  # of a recording's length, within which the next one starts: buffers and a trigger shift its begin


def restarts(time: Array) -> list[int]:
    """The first rows of further recordings in a log; empty if its time (n,) is wrong in another way.

    At each row where time steps back it returns to the begin of the log, and it stays behind for ten rows or more: a
    single wrong time does not. Rows without a time, or with that of the row before, do not count.
    """
    rows = np.flatnonzero(np.isfinite(time))
    rows = rows[np.r_[True, np.diff(time[rows]) != 0.0]] if rows.size else rows
    known = time[rows]
    back = np.flatnonzero(np.diff(known) < 0.0)
    if not back.size:
        return []
    ends = np.append(back[1:], known.size - 1)
    if (ends - back < _SHORTEST_RECORDING).any() or back[0] + 1 < _SHORTEST_RECORDING:
        return []
    behind = known[back + _SHORTEST_RECORDING] < known[back]
    returned = known[back + 1] - known[0] <= _RETURNS * (known[back] - known[0])
    return [int(row) for row in rows[back + 1]] if (behind & returned).all() else []


def recording_rows(time: Array, number: int, where: str) -> slice:
    """The rows of one recording of a file.

    Parameters
    ----------
    time : (n,) of the file. number : of the recording, counted from 1. where : the file and its clock, for messages.

    Raises
    ------
    InputError : the file has fewer recordings.
    """
    begins = [0, *restarts(time), time.size]
    count = len(begins) - 1
    if number > count:
        what = f"has {count} recording{'s' if count > 1 else ''}: its clock restarts {count - 1} times"
        remedy = f"write a number from 1 to {count}" if count > 1 else "remove 'recording'"
        raise InputError(Finding(where, what, f"recording: {number}", remedy))
    return slice(begins[number - 1], begins[number])
