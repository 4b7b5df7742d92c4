"""Long tables: one row for each value, with time, channel name, value and unit, as OBD loggers write them.

SECONDS;PID;VALUE;UNITS
73772.550;Engine RPM;714;rpm
73772.570;Vehicle speed;0;mph

Latitude and longitude may stand in columns of their own, beside each value, and change with each fix of the receiver.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.clocks.clock_unit import unit_of_name
from vdyn_cli.io.clocks.written_times import is_instant, since_first, written_seconds
from vdyn_cli.io.csv.csv_cells import number_of
from vdyn_cli.io.file_units import stated_unit
from vdyn_cli.io.formats.stored_channels import StoredChannel, refuse_missing
from vdyn_cli.io.formats.stored_reader import StoredReader
from vdyn_cli.io.reader import is_clock, since_1970
from vdyn_cli.quantities.arrays import Array, Rows
from vdyn_cli.quantities.errors import Finding, InputError

_NAME = re.compile(
    r"(pid|name|channel|signal|parameter|sensor|variable|measurement|telemetry)s?([ _]?name)?", re.IGNORECASE
)
_VALUE = re.compile(r"((physical|telemetry)[ _]?)?values?", re.IGNORECASE)
_SOURCE = re.compile(r"(\w+_)?(vehicle|car|device|logger)([ _]?(id|name|number|no))?", re.IGNORECASE)
_PLACE = re.compile(r"lat(?:itude)?|lon(?:g(?:t?itude)?)?|lng", re.IGNORECASE)  # LONGTITUDE, as Car Scanner writes it
_UNIT = re.compile(r"units?", re.IGNORECASE)
_DELIMITERS = ";,\t|"
_WIDEST = 16  # columns


@dataclass(frozen=True)
class LongHead:
    """Delimiter, and the indices of the four columns; ``unit`` is -1 if there is none."""

    delimiter: str
    names: tuple[str, ...]
    time: int
    name: int
    value: int
    unit: int


class LongTable:
    """The channels of one file, each with the times of its rows."""

    row = "line"

    def __init__(self, head: LongHead, rows: Sequence[Sequence[str]], lines: Sequence[int]) -> None:
        cells = [np.array([row[i] for row in rows], dtype=object) for i in (head.time, head.name, head.value)]
        time, self._lines = _seconds(cells[0]), np.array(lines)
        values = _numbers(cells[2])
        sources = _sources(head, rows)
        names = [f"{source}\n{name}" for source, name in zip(sources, cells[1], strict=True)]
        self._rows: list[Rows] = [np.flatnonzero(np.array(names) == n) for n in dict.fromkeys(names)]
        self._values = [values[at] for at in self._rows]
        labels = [
            (str(cells[1][at[0]]), rows[int(at[0])][head.unit].strip() if head.unit >= 0 else "") for at in self._rows
        ]
        fixes, places = _places(head, rows if len(set(sources)) == 1 else [])
        self._rows += [fixes] * len(places)
        self._values += [place[fixes] for place in places.values()]
        labels += [(name, "deg") for name in places]
        self._times = [time[at] for at in self._rows]
        unit = "s" if is_instant(str(cells[0][0])) else _unit_of(head.names[head.time], time)
        listed: list[StoredChannel] = []
        for i, at in enumerate(self._rows):
            table = next(k for k in range(i + 1) if np.array_equal(self._times[k], self._times[i]))
            if table == i:
                clock = StoredChannel(head.names[head.time], unit, table, (i, "time"), sources[at[0]], master=True)
                listed.append(clock)
            listed.append(StoredChannel(*labels[i], table, (i, "values"), sources[at[0]]))
        self.listed = tuple(listed)

    def line(self, channel: StoredChannel, row: int) -> int:
        """The line of a channel's row in the file."""
        which = channel.at[0] if isinstance(channel.at, tuple) else 0
        return int(self._lines[self._rows[which][row]])

    def columns(self, wanted: Sequence[StoredChannel]) -> Sequence[Array | None]:
        """Times and values; None for a channel of text."""
        found: list[Array | None] = []
        for channel in wanted:
            which = channel.at[0] if isinstance(channel.at, tuple) else 0
            values = self._times[which] if channel.master else self._values[which]
            found.append(values if np.isfinite(values).any() else None)
        return found


def _places(head: LongHead, rows: Sequence[Sequence[str]]) -> tuple[Rows, dict[str, Array]]:
    """The rows at which the place beside the values changes, and the columns of latitude and longitude (n,); empty
    unless there are two. A receiver without a fix writes zeros or nothing."""
    found = {
        name: _numbers(np.array([row[at] if at < len(row) else "" for row in rows], dtype=object))
        for at, name in enumerate(head.names)
        if _PLACE.fullmatch(name)
    }
    if len(found) != 2:
        return np.array([], dtype=np.intp), {}
    both = np.column_stack([*found.values()])
    fixed = np.flatnonzero(np.isfinite(both).all(axis=1) & (both != 0.0).any(axis=1))
    new = np.r_[True, (np.diff(both[fixed], axis=0) != 0.0).any(axis=1)] if fixed.size else np.array([], dtype=bool)
    return fixed[new], (found if fixed.size else {})


def _sources(head: LongHead, rows: Sequence[Sequence[str]]) -> list[str]:
    """The vehicle or logger of each row, if the file has a column for it with several; else empty texts."""
    for at in (i for i, name in enumerate(head.names) if _SOURCE.fullmatch(name)):
        found = [row[at].strip() if at < len(row) else "" for row in rows]
        if len(set(found)) > 1:
            return found
    return [""] * len(rows)


def _unit_of(clock: str, time: Array) -> str:
    written = time[np.isfinite(time)]
    span = float(np.ptp(written)) if written.size else 0.0
    dates = since_1970(written.size / span, float(written[0])) if span > 0.0 else []
    return stated_unit(clock) or unit_of_name(clock) or next(iter(dates), "s")


def _head(text: str) -> LongHead | None:
    """The columns of a long table; None if the first line is not the header of one."""
    line = text.splitlines()[0] if text.strip() else ""
    for delimiter in _DELIMITERS:
        names = [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]
        while names and not names[-1]:
            names.pop()
        if (head := long_head(names, delimiter)) is not None:
            return head
    return None


def long_head(names: Sequence[str], delimiter: str = "") -> LongHead | None:
    """The columns of a long table among its names; None if they are not those of one."""
    timed = [i for i, n in enumerate(names) if is_clock(n) or n.lower().startswith("second")]
    found = [[i for i, n in enumerate(names) if kind.fullmatch(n)] for kind in (_NAME, _VALUE, _UNIT)]
    if len(timed) == 1 and len(found[0]) == len(found[1]) == 1 and len(found[2]) < 2 and len(names) <= _WIDEST:
        return LongHead(delimiter, tuple(names), timed[0], found[0][0], found[1][0], (found[2] or [-1])[0])
    return None


def _parsed(path: Path) -> LongTable:
    refuse_missing(path)
    text = path.read_bytes().decode("utf-8-sig", "replace")
    head = _head(text)
    assert head is not None  # `matches` has seen it
    width = 1 + max(head.time, head.name, head.value, head.unit)
    reader = csv.reader(StringIO(text), delimiter=head.delimiter)
    next(reader)
    rows: list[list[str]] = []
    lines: list[int] = []
    for row in reader:
        if len(row) >= width and row[head.name].strip():
            rows.append(row)
            lines.append(reader.line_num)
    if not rows:
        raise InputError(Finding(path.name, "has no rows below its header", remedy="export the log again"))
    return LongTable(head, rows, lines)


def _seconds(cells: NDArray[np.object_]) -> Array:
    return since_first(written_seconds(cells)) if is_instant(str(cells[0])) else _numbers(cells)


def _numbers(cells: NDArray[np.object_]) -> Array:
    decimal = "," if any("," in str(cell) for cell in cells) and not any("." in str(cell) for cell in cells) else "."
    values = [number_of(str(cell), decimal)[0] for cell in cells]
    return np.array([np.nan if value is None else value for value in values])


READER = StoredReader(
    lambda head, path: _head(head.decode("utf-8-sig", "replace")) is not None, lambda path: nullcontext(_parsed(path))
)
