"""Tables side by side in one text log, each with its own clock: ``Time;Speed;Time;Torque``.

Every row holds a sample of each table, and their times are independent of each other.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from vdyn_cli.io.clocks.clock_unit import clock_unit
from vdyn_cli.io.csv.csv_columns import unit_in_header
from vdyn_cli.io.csv.csv_layout import Layout, find_layout
from vdyn_cli.io.csv.csv_numbers import Numbers, read_numbers
from vdyn_cli.io.csv.csv_source import open_source
from vdyn_cli.io.formats.stored_channels import StoredChannel
from vdyn_cli.io.reader import ReadOptions, is_clock, rises
from vdyn_cli.quantities.arrays import Array

_OF_A_TABLE = re.compile(r"(time|Time|TIME)(?=[A-Z_ .])")  # begins the name of a table's clock, such as TimeVBOX


class TablesBeside:
    """The channels of one text log with several tables, a ``StoredFile``; a table's rows end with its clock.

    Parameters
    ----------
    layout, numbers : of the file. clocks : index of each table's clock column. text : columns without numbers.
    """

    row = "line"  # the word for a sample's place in messages

    def __init__(self, layout: Layout, numbers: Numbers, clocks: Sequence[int], text: frozenset[int]) -> None:
        self._numbers, self._text = numbers, text
        self._clock = {i: max((c for c in clocks if c <= i), default=clocks[0]) for i in range(len(layout.header))}
        self._rows = {i: int(np.flatnonzero(np.isfinite(numbers.columns[i]))[-1]) + 1 for i in clocks}
        begins, first = numbers.begins, numbers.begins.get(clocks[0], math.nan)
        self._late = {i: begins[i] - first for i in clocks if i in begins and np.isfinite(first)}
        named = {layout.header[i] for i in clocks}
        alike = len(named) == 1
        listed: list[StoredChannel] = []
        for i, name in enumerate(layout.header):
            if not name or (name in named and i not in clocks):  # the clock of an empty table
                continue
            unit = unit_in_header(layout, i)
            if i in clocks and not alike:  # a clock of another name is that of its table in any case
                unit = clock_unit(name, unit, numbers.columns[i])[0]
            source = layout.sources[i].strip() if layout.sources and i not in clocks else ""
            begin = first if i in clocks else math.nan
            group = f"table {clocks.index(self._clock[i]) + 1}"
            master = i in clocks and not alike
            listed.append(StoredChannel(name, unit, self._clock[i], i, group, source, master, begin))
        self.listed = tuple(listed)

    def line(self, channel: StoredChannel, row: int) -> int:
        """The line of a row in the file."""
        return self._numbers.lines.of(row)

    def columns(self, wanted: Sequence[StoredChannel]) -> Sequence[Array | None]:
        """The samples (n,) of channels; None for text. All clocks count from the first time of the first one."""
        return [self._samples(int(str(one.at))) for one in wanted]

    def _samples(self, at: int) -> Array | None:
        if at in self._text:
            return None
        return self._numbers.columns[at][: self._rows[self._clock[at]]] + self._late.get(at, 0.0)


def separate_clocks(names: Sequence[str], columns: Mapping[int, Array]) -> tuple[int, ...]:
    """The positions of the clocks of tables side by side; empty for one table, whose clocks are those of all rows.

    A later clock is that of a table of its own if it has the name of the one before, but other times, or if one of them
    ends before the other, as tables of different lengths do. Two clocks in neighboring columns belong to one table.

    Parameters
    ----------
    names : of all columns. columns : (n,) of those that have the name or the unit of a clock, by position.
    """
    clocks = [i for i in sorted(columns) if rises(columns[i])]
    found = clocks[:1]
    for i in clocks[1:]:
        before, own = columns[found[-1]], columns[i]
        again = names[i] == names[found[-1]] and not np.array_equal(before, own, equal_nan=True)
        if i > found[-1] + 1 and (again or _ends(before) != _ends(own)):
            found.append(i)
    return tuple(found) if len(found) > 1 else ()


def may_be_clock(name: str, unit: str) -> bool:
    """Whether a column may be the clock of one of several tables, by its name or its unit."""
    return bool(name) and (is_clock(name, unit) or _OF_A_TABLE.match(name) is not None)


def are_complete(clocks: Sequence[int], columns: Mapping[int, Array]) -> bool:
    """Whether no column (n,) goes on after the clock of its table has ended, as beside a counter that stops early."""
    for i, values in columns.items():
        clock = columns[max((c for c in clocks if c <= i), default=clocks[0])]
        if np.isfinite(values[~np.isfinite(clock)]).any():
            return False
    return True


def _ends(time: Array) -> int:
    """The number of rows up to the last time; that of the column if times are missing before."""
    rows = int(np.count_nonzero(np.isfinite(time)))
    return rows if np.isfinite(time[:rows]).all() else time.size


def tables_beside(path: Path, wanted: Sequence[str], options: ReadOptions, name: str) -> TablesBeside | None:
    """The tables side by side in a file; None if it has one table.

    Parameters
    ----------
    wanted : columns named in the description; the first is the clock. name : of the file, for messages.

    Raises
    ------
    InputError : the file has no table.
    """
    with open_source(path, options.encoding) as source:
        layout = find_layout(next(source.blocks, b""), source.encoding, wanted, options, name)
    timed = [i for i, cell in enumerate(layout.header) if may_be_clock(cell, unit_in_header(layout, i))]
    if len(timed) < 2:
        return None
    every = range(len(layout.header))
    with open_source(path, options.encoding) as source:
        numbers = read_numbers(source.blocks, layout, timed, source.encoding, name)
    if not numbers.complete or not (clocks := separate_clocks(layout.header, numbers.columns)):
        return None
    with open_source(path, options.encoding) as source:
        numbers = read_numbers(source.blocks, layout, every, source.encoding, name)
    text = frozenset(c.column for c in numbers.bad if c.column not in clocks)
    return TablesBeside(layout, numbers, clocks, text) if are_complete(clocks, numbers.columns) else None
