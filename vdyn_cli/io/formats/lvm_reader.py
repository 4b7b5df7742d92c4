"""LabVIEW measurement files (.lvm): segments, each with a header, joined on one time axis.

Format: National Instruments, "Specification for the LabVIEW Measurement File (.lvm)".
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from datetime import datetime
from io import StringIO
from pathlib import Path

import numpy as np

from vdyn_cli.io.formats.stored_channels import StoredChannel, refuse_missing
from vdyn_cli.io.formats.stored_reader import StoredReader
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, InputError

_MAGIC = b"LabVIEW Measurement"
_END = "***End_of_Header***"
_SINCE_1904 = 1e9  # s; a larger time is absolute, counted from 1904, and not relative to a test


@dataclass(frozen=True)
class _Segment:
    """One header and its rows: channel names and units, start time (s), line of the first row, times and values."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    start: float
    first_line: int
    times: tuple[Array, ...]
    values: tuple[Array, ...]


class _LvmTable:
    """The channels of all segments."""

    row = "line"

    def __init__(self, segments: Sequence[_Segment]) -> None:
        first = segments[0]
        self._times = [np.concatenate([s.times[i] for s in segments]) for i in range(len(first.names))]
        self._values = [np.concatenate([s.values[i] for s in segments]) for i in range(len(first.names))]
        self._segments = segments
        clock_of = [self._first_alike(i) for i in range(len(first.names))]
        listed: list[StoredChannel] = []
        for i in dict.fromkeys(clock_of):
            listed.append(StoredChannel("X_Value", "s", i, (i, "time"), master=True))
            members = [k for k in range(len(first.names)) if clock_of[k] == i]
            listed += [StoredChannel(first.names[k], first.units[k], i, (k, "values")) for k in members]
        self.listed = tuple(listed)

    def _first_alike(self, i: int) -> int:
        """The index of the first channel with the same times."""
        return next(k for k in range(i + 1) if np.array_equal(self._times[k], self._times[i]))

    def line(self, channel: StoredChannel, row: int) -> int:
        """The line of a row in the file."""
        which = channel.at[0] if isinstance(channel.at, tuple) else 0
        for segment in self._segments:
            if row < segment.values[which].size:
                return segment.first_line + row
            row -= segment.values[which].size
        return 0

    def columns(self, wanted: Sequence[StoredChannel]) -> Sequence[Array | None]:
        """Times and values as parsed."""
        return [(self._times if c.master else self._values)[c.at[0]] for c in wanted if isinstance(c.at, tuple)]


def _parsed(path: Path) -> _LvmTable:
    refuse_missing(path)
    lines = path.read_bytes().decode("utf-8-sig", "replace").splitlines()
    ends = [i for i, line in enumerate(lines) if line.strip().startswith(_END)]
    if len(ends) < 2:
        what = "has no channel header: the file is incomplete"
        raise InputError(Finding(path.name, what, remedy="export or record it again"))
    general = _fields(lines[: ends[0]], "\t" if any("\t" in line for line in lines[: ends[0]]) else ",")
    separator = "," if general.get("Separator", ["Tab"])[0].lower() == "comma" else "\t"
    general = _fields(lines[: ends[0]], separator)
    decimal = general.get("Decimal_Separator", ["."])[0] or "."
    segments: list[_Segment] = []
    for n, end in enumerate(ends[1:]):
        begin = _header_begin(lines, ends[n] + 1, end)
        stop = _header_begin(lines, end + 1, ends[n + 2]) if n + 2 < len(ends) else len(lines)
        header = _fields(lines[begin:end], separator)
        segments.append(_segment(lines[end + 1 : stop], end + 2, header, general, (separator, decimal, path.name)))
    if any(s.names != segments[0].names for s in segments):
        raise InputError(Finding(path.name, "segments have different channels", remedy="split the file"))
    return _LvmTable(_from_first(segments))


def _header_begin(lines: Sequence[str], start: int, end: int) -> int:
    """The line of the last ``Channels`` before the end of a header: the first line of a segment's header."""
    return max((i for i in range(start, end) if lines[i].startswith("Channels")), default=end)


def _fields(lines: Sequence[str], separator: str) -> dict[str, list[str]]:
    cells = [[c.strip() for c in line.split(separator)] for line in lines]
    return {row[0]: row[1:] for row in cells if row[0] and len(row) > 1}


def _segment(
    lines: Sequence[str],
    first_line: int,
    header: Mapping[str, list[str]],
    general: Mapping[str, list[str]],
    form: tuple[str, str, str],
) -> _Segment:
    """One segment's channels; times from its X columns, or from X0 and Delta_X if it has none."""
    separator, decimal, name = form
    count = int(header["Channels"][0])
    head = next(csv.reader([lines[0]], delimiter=separator)) if lines else []
    layout = general.get("X_Columns", ["One"])[0].lower()
    stride, offset = (2, 1) if layout == "multi" else (1, 1)
    places = [offset + stride * k for k in range(count)]
    if len(head) <= places[-1]:
        what = f"line {first_line} names {max(len(head) - 1, 0)} of {count} channels"
        raise InputError(Finding(f"{name}:{first_line}", what, remedy="export it again"))
    rows = [line for line in lines[1:] if re.search(r"\d", line)]
    xs = [place - 1 for place in places] if layout == "multi" else [0] * count
    table = _numbers(rows, {*places, *xs}, len(head), (separator, decimal, f"{name}:{first_line + 1}"))
    values: list[Array] = []
    times: list[Array] = []
    for k, place in enumerate(places):
        written = _trimmed(table[place])
        values.append(written)
        x0, step = (_number(header.get(key, []), k, decimal) for key in ("X0", "Delta_X"))
        counted = (x0 if np.isfinite(x0) else 0.0) + np.arange(written.size) * step
        times.append(np.asarray(counted) if layout == "no" else table[xs[k]][: written.size])
    units = [header.get("Y_Unit_Label", [""] * count)[k : k + 1] for k in range(count)]
    return _Segment(
        tuple(head[place].strip() for place in places),
        tuple(u[0] if u else "" for u in units),
        _start(header) if np.isfinite(_start(header)) else _start(general),
        first_line + 1,
        tuple(times),
        tuple(values),
    )


def _numbers(rows: Sequence[str], at: set[int], width: int, form: tuple[str, str, str]) -> dict[int, Array]:
    separator, decimal, where = form
    import pandas as pd

    try:
        table = pd.read_csv(
            StringIO("\n".join(rows)),
            sep=separator,
            decimal=decimal,
            header=None,
            names=range(width + 1),
            dtype={i: float if i in at else str for i in range(width + 1)},
            index_col=False,
            quoting=csv.QUOTE_NONE,
        )
    except (ValueError, pd.errors.ParserError) as error:
        raise InputError(Finding(where, "has text among the numbers", str(error)[:80], "export it again")) from None
    return {i: table[i].to_numpy(dtype=float) for i in at}


def _trimmed(values: Array) -> Array:
    """The values without the empty cells below a channel that is shorter than others of its segment."""
    written = np.flatnonzero(np.isfinite(values))
    return values[: written[-1] + 1] if written.size else values[:0]


def _number(cells: Sequence[str], k: int, decimal: str) -> float:
    try:
        return float(cells[k].replace(decimal, "."))
    except (IndexError, ValueError):
        return float("nan")


def _start(header: Mapping[str, list[str]]) -> float:
    """Date and time of a header, s from an arbitrary origin; NaN if it states none."""
    try:
        day = datetime.strptime(header["Date"][0], "%Y/%m/%d")
        hours, minutes, seconds = header["Time"][0].replace(",", ".").split(":")
    except (KeyError, ValueError, IndexError):
        return float("nan")
    return day.timestamp() + 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds)


def _from_first(segments: Sequence[_Segment]) -> list[_Segment]:
    """The segments with times from the start of the first: by X if it is continuous or absolute, else by the dates."""
    shifted: list[_Segment] = []
    absolute = any(t.size and t[0] > _SINCE_1904 for t in segments[0].times)
    origin = min((float(t[0]) for t in segments[0].times if t.size), default=0.0) if absolute else 0.0
    before = -np.inf
    for segment in segments:
        begins = min((float(t[0]) for t in segment.times if t.size), default=0.0)
        by_date = segment.start - segments[0].start
        restarts = begins <= before and np.isfinite(by_date)
        shift = -origin if absolute else (by_date if restarts else 0.0)
        times = tuple(t + shift for t in segment.times)
        before = max([before, *(float(t[-1]) for t in times if t.size)])
        shifted.append(_Segment(segment.names, segment.units, segment.start, segment.first_line, times, segment.values))
    return shifted


READER = StoredReader(
    lambda head, path: head.lstrip(b"\xef\xbb\xbf").startswith(_MAGIC), lambda path: nullcontext(_parsed(path))
)
