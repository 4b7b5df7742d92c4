"""Reader of CSV logs: only the mapped columns, with a finding for everything doubtful."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np

from vdyn_cli.io.clocks.appended_recordings import recording_rows
from vdyn_cli.io.clocks.clock_unit import clock_unit
from vdyn_cli.io.clocks.sample_times import LineOf, check_rising
from vdyn_cli.io.clocks.written_times import past_midnight, seconds_of_digits, since_first
from vdyn_cli.io.csv.csv_columns import match_columns, unit_in_header
from vdyn_cli.io.csv.csv_layout import Layout, find_layout
from vdyn_cli.io.csv.csv_numbers import Lines, Numbers, read_numbers
from vdyn_cli.io.csv.csv_rows import data_rows, has_decimal_commas
from vdyn_cli.io.csv.csv_source import is_other_format, open_source
from vdyn_cli.io.csv.run_rows import runs_as_columns
from vdyn_cli.io.csv.tables_beside import TablesBeside, are_complete, may_be_clock, separate_clocks, tables_beside
from vdyn_cli.io.formats.split_times import split_instants
from vdyn_cli.io.formats.stored_channels import read_stored, recorded
from vdyn_cli.io.reader import (
    COUNTED,
    ChannelInfo,
    Column,
    ReadOptions,
    Recorded,
    UnitFrom,
    channel_info,
    clock_seconds,
    has_usual_rate,
    is_clock,
    late_rows,
    rises,
    rises_but_for,
)
from vdyn_cli.quantities.arrays import Array, Mask, Rows
from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.log import Log, LogSource

# Share of the rows with a time of the most complete clock, below which another one is that of some channels only, such
# as the receiver's time in its own rows.
_COMPLETE = 0.5
_FROM_START = 1.0  # s, first time of a clock that counts from the start that the head of a file states in whole seconds


class CsvReader:
    """Comma, semicolon, tab, bar or blank separated text, plain or gzip, in any common encoding."""

    def matches(self, path: Path) -> bool:
        """Whether the file may be text, as it has no known binary format."""
        return path.is_file() and not is_other_format(path)

    def channels(self, path: Path) -> tuple[ChannelInfo, ...]:
        """Every named column, the clock included.

        Raises
        ------
        InputError : no such file, no header, no numbers.
        """
        return tuple(found.info for found in self.recordings(path))

    def recordings(self, path: Path) -> Iterator[Recorded]:
        """Every named column with its samples; cells of text count as empty."""
        return self.selected(path, bool)

    def selected(self, path: Path, only: Callable[[str], bool]) -> Iterator[Recorded]:
        """Every named column, the samples only of clocks and of the columns for whose name ``only`` is true."""
        layout, numbers, text = _whole_table(path, only)
        names = {i: cell for i, cell in enumerate(layout.header) if cell}
        units = {i: unit_in_header(layout, i) for i in names}
        bare = layout.header_line == 0  # any column may be the clock
        timed = [i for i, cell in names.items() if i not in text and (bare or is_clock(cell, units[i]))]
        begins = dict(numbers.begins)
        for i in (i for i in timed if not units[i]):
            if (of_day := seconds_of_digits(numbers.columns[i], names[i])) is not None:
                numbers.columns[i], units[i] = since_first(of_day), "s"
                begins[i] = float(of_day[np.isfinite(of_day)][0])
        numbers.columns.update({i: past_midnight(numbers.columns[i]) for i in timed if units[i] == "s"})
        columns = numbers.columns
        of_tables = [i for i, cell in names.items() if i not in text and may_be_clock(cell, units[i])]
        beside = separate_clocks(layout.header, {i: columns[i] for i in of_tables})
        if beside and are_complete(beside, columns):
            yield from recorded(TablesBeside(layout, numbers, beside, text))
            return
        most = max((_written(columns[i]) for i in timed), default=0)
        rising = [i for i in timed if rises(columns[i])]
        rising = rising or [i for i in timed if is_clock(names[i], units[i]) and rises_but_for(columns[i])]

        def doubts(i: int) -> tuple[bool, ...]:
            few = _written(columns[i]) < _COMPLETE * most
            return not has_usual_rate(columns[i], units[i]), few, not is_clock(names[i]), _is_coarse(columns[i])

        clock, late = min(rising, key=doubts, default=None), 0
        time: Array | None = None
        unit_from: UnitFrom = "file"
        if clock is not None:
            raw = columns[clock]
            units[clock], unit_from = clock_unit(names[clock], units[clock], raw)
            late = rises_but_for(raw) and int(np.count_nonzero(late_rows(raw) & ~_repeated(columns.values())))
            time = clock_seconds(raw if rises(raw) else np.where(late_rows(raw), np.nan, raw), units[clock])
            if abs(time[np.isfinite(time)][0]) < _FROM_START:
                begins.setdefault(clock, layout.start)
        for i, name in names.items():
            values = None if i in text else time if i == clock else columns[i]
            device = layout.sources[i].strip() if layout.sources else ""
            info = replace(channel_info(name, units[i], time, values, source=device), begin=begins.get(i, math.nan))
            yield Recorded(replace(info, unit_from=unit_from, late=late) if i == clock else info, time, values)

    def read(self, path: Path, mapping: Mapping[str, Column], options: ReadOptions, name: str) -> Log:
        """The mapped columns in the file's units; see ``vdyn_cli.io.reader.Reader``.

        Rows without any value and a summary below the data are left out. A decimal comma is recognized. Thousands
        separators are removed and reported where the decimal mark is certain: from ``1.234,5`` or ``1,234.5``, and
        from ``1,234`` beside numbers with a point. Units in headers and units rows are compared with the mapping's.

        Raises
        ------
        InputError : with all problems of the file: no such file or column, text among the numbers, fewer than two rows
            of data. A clock that does not increase is a problem in the log's source.
        """
        if options.rate is not None:
            mapping = {channel: column for channel, column in mapping.items() if channel != "time"}
        wanted = _wanted(mapping)
        with_clocks = options.split_times is None and options.rate is None
        if with_clocks and (beside := tables_beside(path, wanted, options, name)) is not None:
            options = replace(options, delimiter=None, decimal=None, encoding=None, header_row=None)
            clock = mapping["time"]  # Time#2, of several tables, is the clock of each of them
            plain = replace(clock, column=re.sub(r"#\d+$", "", clock.column))
            return read_stored(beside, {**mapping, "time": plain}, options, name)
        layout, numbers, position, findings = _read(path, mapping, options, name)
        rows = data_rows(numbers, layout, position, name, joined=options.recording is not None)
        raise_all(rows.problems)
        raw = {channel: numbers.columns[at][: rows.stop] for channel, at in position.items()}
        columns = {channel: layout.header[at] for channel, at in position.items()}
        if options.rate is not None:
            mapping, columns = {**mapping, "time": COUNTED}, {"time": COUNTED.column, **columns}
            raw["time"] = np.arange(rows.stop) / options.rate
        begin = numbers.begins.get(position.get("time", -1), math.nan)
        logged = with_clocks and mapping["time"].unit == "s"
        if logged and (of_day := seconds_of_digits(raw["time"], columns["time"])) is not None:
            raw["time"], begin = since_first(of_day), float(of_day[np.isfinite(of_day)][0])
            what = "channel 'time' is read as hours, minutes and seconds in digits, hhmmss.ss"
            findings.append(Finding(f"{name}, column '{columns['time']}'", what, minor=True))
        raw["time"] = past_midnight(raw["time"]) if logged else raw["time"]
        place = f"{name}, column '{columns['time']}'"
        written = _rising(raw, rows.kept, numbers.lines, mapping["time"], options, place)
        numbers.columns.clear()
        source = LogSource(columns, written.line_of, written.problems)
        every = (*findings, *rows.findings, *written.findings)
        return Log(name, written.time, written.channels, every, source, begin=begin)


CSV = CsvReader()


def _whole_table(path: Path, only: Callable[[str], bool]) -> tuple[Layout, Numbers, frozenset[int]]:
    """The selected columns of a file without a mapping, and the indices of the others and of columns of text."""
    text: frozenset[int] = frozenset()
    while True:
        with open_source(path) as source:
            first = next(source.blocks, b"")
            layout = find_layout(first, source.encoding, (), ReadOptions(), path.name)
            text |= _not_selected(layout, only)
            positions = [i for i in range(len(layout.header)) if i not in text]
            if not positions:
                what = "contains only text, no column of numbers"
                raise InputError(Finding(path.name, what, remedy="export the log again, with its data"))
            numbers = read_numbers(chain([first], source.blocks), layout, positions, source.encoding, path.name)
        bad = [cell.column for cell in numbers.bad]
        most = max((bad.count(i) for i in set(bad)), default=0)
        worse = {i for i in positions if bad.count(i) and _is_text(bad.count(i), numbers.columns[i])}
        # Reading stops at many cells of text: read again without the column that has most of them.
        worse |= {i for i in positions if not numbers.complete and bad.count(i) == most}
        if not worse:
            return layout, numbers, text
        text |= worse


def _not_selected(layout: Layout, only: Callable[[str], bool]) -> frozenset[int]:
    """The columns that need not be read: those with another name, and no clock; none of a table without a header."""
    clocks = {i for i, cell in enumerate(layout.header) if may_be_clock(cell, unit_in_header(layout, i))}
    others = (i for i, cell in enumerate(layout.header) if cell and not only(cell))
    return frozenset(others) - layout.instants - clocks if layout.header_line else frozenset()


def _repeated(columns: Iterable[Array]) -> Mask:
    """Which rows have the same numbers as the previous one, which are left out without a key."""
    same = [np.r_[False, (x[1:] == x[:-1]) | (np.isnan(x[1:]) & np.isnan(x[:-1]))] for x in columns]
    return np.asarray(np.all(same, axis=0))


def _written(time: Array) -> int:
    return int(np.count_nonzero(np.isfinite(time)))


def _is_coarse(time: Array) -> bool:
    """Whether a clock repeats more than a hundredth of its times, such as one of full seconds beside a finer one."""
    steps = np.diff(time[np.isfinite(time)])
    return bool(np.count_nonzero(steps == 0.0) > 0.01 * steps.size)


def _wanted(mapping: Mapping[str, Column]) -> list[str]:
    """The names of the mapped columns, the clock first."""
    return [c.column for _, c in sorted(mapping.items(), key=lambda one: one[0] != "time")]


def _is_text(bad: int, values: Array) -> bool:
    """Whether more cells of a column are text than numbers."""
    return bad > int(np.count_nonzero(np.isfinite(values)))


def _read(
    path: Path, columns: Mapping[str, Column], options: ReadOptions, name: str
) -> tuple[Layout, Numbers, Mapping[str, int], list[Finding]]:
    """The file's layout, the mapped numbers, the index of each channel's column, and the findings so far."""
    wanted = _wanted(columns)
    with open_source(path, options.encoding) as source:
        first = next(source.blocks, b"")
        if options.split_runs == "rows":
            source = runs_as_columns(source, first, name, options.levels)
            options = replace(options, delimiter="tab", header_row=1)
            first = next(source.blocks, b"")
        layout = find_layout(first, source.encoding, wanted, options, name)
        match = match_columns(layout, columns, name)
        raise_all(match.problems)
        positions = list(match.position.values())
        numbers = read_numbers(chain([first], source.blocks), layout, positions, source.encoding, name)
    if not layout.decimal and has_decimal_commas(numbers, layout.delimiter):
        return _read(path, columns, replace(options, decimal=","), name)
    return layout, numbers, match.position, [*layout.findings, *match.findings]


@dataclass(frozen=True)
class _Written:
    """The data rows with increasing time (SI), the file's line of each, findings, and problems of the clock."""

    time: Array
    channels: Mapping[str, Array]
    line_of: LineOf
    findings: tuple[Finding, ...]
    problems: tuple[Finding, ...]


def _rising(
    raw: dict[str, Array], kept: Rows | None, lines: Lines, clock: Column, options: ReadOptions, where: str
) -> _Written:
    if kept is not None:
        raw = {channel: values[kept] for channel, values in raw.items()}
    if options.recording is not None:
        own = recording_rows(raw["time"], options.recording, where)
        kept = (np.arange(raw["time"].size) if kept is None else kept)[own]
        raw = {channel: values[own] for channel, values in raw.items()}
    if options.split_times is not None:
        table = split_instants(raw["time"], options.split_times, where)
        raise_all(table.problems)
        raw = {channel: values[table.rows] for channel, values in raw.items()} | {"time": table.time}
        kept = table.rows if kept is None else kept[table.rows]
    time = raw["time"] = clock.in_si(raw["time"])
    channels = {channel: values for channel, values in raw.items() if channel != "time"}
    rising = check_rising(time, options.clock, where, partial(_line, lines, kept), channels=channels)
    if rising.kept is not None:
        rows = np.flatnonzero(rising.kept)
        raw = {channel: values[rows] for channel, values in raw.items()}
        kept = rows if kept is None else kept[rows]
    problems = list(rising.problems)
    if raw["time"].size < 2:
        nothing = Finding(where, "fewer than two rows of data", remedy="export the log again, with its data")
        raise_all(problems or [nothing])
    return _Written(raw.pop("time"), raw, partial(_line, lines, kept), rising.findings, tuple(problems))


def _line(lines: Lines, kept: Rows | None, row: int) -> int:
    return lines.of(int(row if kept is None else kept[row]))
