"""Detection of a text log's layout: delimiter, decimal mark, and lines of header, units and numbers."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

from vdyn_cli.io.clocks.written_times import is_day, is_instant, stated_start
from vdyn_cli.io.csv.csv_cells import COMPASS, decimal_mark, is_number, is_written, may_be_thousands, tidy
from vdyn_cli.io.csv.csv_table import (
    EXAMINED_ROWS,
    MOST_SCORE,
    CsvRow,
    CsvTable,
    decoded,
    holds_units,
    is_numbers,
    is_value,
    numeric_columns,
    single_column,
    table_with_header,
    table_without_header,
    unit_behind,
    ways_to_quote,
)
from vdyn_cli.io.file_units import unit_text
from vdyn_cli.io.reader import ReadOptions
from vdyn_cli.quantities.errors import Finding, InputError

# Bytes and lines to examine: the first suffices if it has the wanted columns, the last is for files with thousands of
# columns.
_HEADS = ((1 << 15, 250), (1 << 16, 1000), (1 << 20, 1000))
_FEWEST_UNITS = 0.3  # least share of units in a row of units between header and numbers
_DELIMITERS = (";", "\t", ",", "|", " ")
_OF_NO_LINE = ","  # delimiter of a file of one column
_MILLISECONDS = re.compile(r"\W*(ms|msecs?|millis|milliseconds?)\W*", re.IGNORECASE)
_MARKS = "comma, semicolon, tab, bar or blank"
_DIRECTION = re.compile(r"\bdir|wind|heading|bearing|richtung", re.IGNORECASE)
_STAMP = re.compile(r"(.*?)(?:sec|secs|seconds)\n\1(?:nanosec|nsec|nsecs|nanoseconds)")  # names of two columns
_STAMPED = re.compile(r"1\d{9}\n\d{1,9}")  # cells of two columns: seconds since 1970 and nanoseconds
_STATED = re.compile(r'"?sep=([^"\r\n])"?[;,\t]*\s*', re.IGNORECASE)  # first line of a file for Excel
_NAMED = {"tab": "\t", "\\t": "\t", "space": " ", "blank": " ", "comma": ",", "semicolon": ";", "pipe": "|"}


@dataclass(frozen=True)
class Layout:
    """Layout of a text log; ``decimal`` is empty if the head of the file has only whole numbers.

    ``instants``: indices of columns of times of day, with or without date; ``dates`` and ``milliseconds``: index of
    such a column to that of the column with its date or its milliseconds. ``nanoseconds``: the same for columns of
    seconds. ``behind``: index of each column of cells such as ``35 km/h`` to the unit in them; ``compass``: indices of
    columns of points of the compass, such as NNE, which count as degrees. ``sources``: texts of a
    row below the header that are not units, such as the devices; as long as the header, or empty. ``start``: of the
    recording, as the lines above the header state it (``stated_start``); NaN if they do not.
    """

    delimiter: str
    decimal: str
    header: tuple[str, ...]
    header_line: int  # 0 without a header
    units: tuple[str, ...]  # as long as the header, or empty where there is no units row
    first_line: int  # of the numbers, counted from 1
    offset: int  # byte at which the numbers begin
    instants: frozenset[int] = frozenset()
    dates: Mapping[int, int] = field(default_factory=dict)
    milliseconds: Mapping[int, int] = field(default_factory=dict)
    nanoseconds: Mapping[int, int] = field(default_factory=dict)
    behind: Mapping[int, str] = field(default_factory=dict)
    compass: frozenset[int] = frozenset()
    sources: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()
    start: float = math.nan


def find_layout(head: bytes, encoding: str, wanted: Collection[str], options: ReadOptions, name: str) -> Layout:
    """Find the header, the units row and the first row of numbers.

    The header is the row with most of the wanted columns; if no row has any, the text row above the numbers that
    resembles them most, so that the message on missing columns can list the existing ones. The columns of a table
    without a header are called ``column 1`` and so on.

    Parameters
    ----------
    head : the first block of the file, whole lines.
    encoding : of the file.
    wanted : columns named in the description; the first is the clock.
    options : format of the file where it is not to be guessed.
    name : of the file, for messages.

    Raises
    ------
    InputError : no header, no numbers, or an impossible delimiter.
    """
    wanted = [tidy(w) for w in wanted]
    stated = _STATED.fullmatch(head[: head.find(b"\n") + 1].decode("latin-1"))
    if stated:  # blanks keep the line's number and length
        options = replace(options, delimiter=options.delimiter or stated[1])
        head = b" " * (stated.end() - 1) + head[stated.end() - 1 :]
    for size, most in _HEADS if wanted else _HEADS[1:]:
        lines = head[:size].splitlines(keepends=True)
        if len(head) > size:
            lines = lines[:-1]
        part = len(head) > size or len(lines) > most
        lines = lines[:most]
        # Latin-1 gives one character per byte for any encoding; header cells are decoded separately.
        text = [line.decode("latin-1") for line in lines]
        choices = [(d, records) for d in _delimiters(options, text, name) for records in ways_to_quote(text, d)]
        table = _best_table(choices, encoding, wanted, options)
        if table is not None and (most > _HEADS[0][1] or not part or 0 < table.hits == len(set(wanted))):
            start = stated_start(text[: max(table.header_line - 1, 0)])
            return replace(_layout(table, [len(line) for line in lines], options, name), start=start)
        if not part:
            break
    if not choices:
        choices = [(_OF_NO_LINE, records) for records in ways_to_quote(text, _OF_NO_LINE)]
        if (column := single_column(*choices[0], encoding, wanted)) is not None:
            return _layout(column, [len(line) for line in lines], options, name)
        choices = []
    bare = table_without_header(choices, wanted) if options.header_row is None else None
    if bare is not None:
        return _layout(bare, [len(line) for line in lines], options, name)
    raise _no_table(choices, encoding, options, name)


def _best_table(
    choices: Sequence[tuple[str, list[CsvRow]]], encoding: str, wanted: Sequence[str], options: ReadOptions
) -> CsvTable | None:
    """The table with most wanted columns, or else the highest score; the first that reaches the highest possible."""
    best: CsvTable | None = None
    for delimiter, records in choices:
        table = table_with_header(delimiter, records, encoding, wanted, options)
        if table and (best is None or (table.hits, table.score) > (best.hits, best.score)):
            best = table
            if (best.hits, best.score) == (len(set(wanted)), MOST_SCORE):
                break
    return best


def _delimiters(options: ReadOptions, lines: Sequence[str], name: str) -> list[str]:
    if options.delimiter is None:
        return [d for d in _DELIMITERS if any(d in line for line in lines)]
    given = _NAMED.get(options.delimiter.lower(), options.delimiter)
    if len(given) != 1 or given in '\r\n"' or ord(given) > 126 or given.isalnum():
        remedy = "use one character, or the words tab, space, comma, semicolon"
        raise InputError(Finding(name, "cannot be a delimiter", repr(options.delimiter), remedy))
    return [given]


def _instants(table: CsvTable) -> tuple[frozenset[int], dict[int, int]]:
    """The columns in which most of the first cells are times of day, and the columns of dates of those without one.

    Hours and minutes alone are a time of day only beside a date.
    """
    rows = [record.fields for record in table.numbers[:30]]
    columns = [[row[i].strip() if i < len(row) else "" for row in rows] for i in range(len(table.header))]

    def mostly(cells: Iterable[str], test: Callable[[str], bool]) -> bool:
        return 2 * sum(map(test, cells)) > len(rows)

    days = [i for i, cells in enumerate(columns) if mostly(cells, is_day)]
    dates: dict[int, int] = {}
    for i, cells in enumerate(columns):
        if days and i not in days:
            day = min(days, key=lambda day: abs(day - i))
            if mostly(map(" ".join, zip(columns[day], cells, strict=True)), is_instant):
                dates[i] = day
    return frozenset(dates) | {i for i, cells in enumerate(columns) if mostly(cells, is_instant)}, dates


def _units_behind(table: CsvTable) -> dict[int, str]:
    """The columns in which most of the first written cells are numbers with the same unit, and that unit."""
    found: dict[int, str] = {}
    for i in range(len(table.header)):
        cells = [r.fields[i] for r in table.numbers[:30] if i < len(r.fields) and is_written(r.fields[i])]
        unit, count = Counter(map(unit_behind, cells)).most_common(1)[0] if cells else ("", 0)
        if unit and 2 * count > len(cells):
            found[i] = unit
    return found


def _compass(table: CsvTable) -> frozenset[int]:
    """The columns of directions in which all of the first written cells are points of the compass.

    The letters alone do not suffice: N is also a gear, and E the hemisphere of a longitude.
    """
    named = [i for i, name in enumerate(table.header) if _DIRECTION.search(name)]
    cells = {i: [r.fields[i].strip() for r in table.numbers[:30] if i < len(r.fields)] for i in named}
    return frozenset(i for i in named if (some := [*filter(is_written, cells[i])]) and set(some) <= COMPASS.keys())


def _layout(table: CsvTable, lengths: Sequence[int], options: ReadOptions, name: str) -> Layout:
    first = table.numbers[0].line
    units, skipped = _units_row(table)
    skipped_rows = tuple(
        Finding(f"{name}:{r.line}", "row between header and numbers skipped", repr(table.delimiter.join(r.fields)[:60]))
        for r in skipped[:3]
    )
    sources = next((tuple(r.fields) for r in skipped if len(r.fields) == len(table.header)), ())
    instants, dates = _instants(table)
    return Layout(
        table.delimiter,
        options.decimal or _decimal(table),
        tuple(table.header),
        table.header_line,
        units,
        first,
        sum(lengths[: first - 1]),
        instants,
        dates,
        {i: i + 1 for i in instants if _MILLISECONDS.fullmatch("".join(table.header[i + 1 : i + 2]))},
        _nanoseconds(table),
        _units_behind(table),
        _compass(table),
        sources,
        skipped_rows,
    )


def _nanoseconds(table: CsvTable) -> dict[int, int]:
    """Columns of seconds to those of their nanoseconds, beside them: by names, or by values as long as both have."""
    beside = enumerate(pairwise(table.header))
    if table.header_line:
        return {i: i + 1 for i, two in beside if _STAMP.fullmatch("\n".join(two))}
    cells = [row.fields for row in table.numbers]
    return {i: i + 1 for i, _ in beside if all(_STAMPED.fullmatch("\n".join(row[i : i + 2])) for row in cells)}


def _units_row(table: CsvTable) -> tuple[tuple[str, ...], list[CsvRow]]:
    """The units, from a row between header and numbers, or the header; and the other, skipped rows between them."""
    rows = [r for r in table.between if any(f.strip() for f in r.fields)]
    units: tuple[str, ...] = ()
    named = (r for r in rows if not all(map(is_number, r.fields)))  # 1 is also a unit
    stated = next((r for r in named if holds_units(r.fields, _FEWEST_UNITS)), None)
    if stated is not None:
        cells = [unit_text(f) for f in stated.fields]
        units = tuple((cells + [""] * len(table.header))[: len(table.header)])
        rows.remove(stated)
    elif any(table.barred):
        units = tuple(table.barred)
    elif table.above and holds_units(table.above) and not holds_units(table.header):
        units = tuple(unit_text(f) for f in table.above)
    return units, rows


def _decimal(table: CsvTable) -> str:
    """The decimal mark of most numbers in the mapped columns, or, if they are whole numbers, in all columns."""
    rows = [record.fields for record in table.numbers[:EXAMINED_ROWS]]
    for columns in (table.mapped, range(max(map(len, rows), default=0))):
        cells = [row[i] for row in rows for i in columns if i < len(row)]
        counts = Counter(decimal_mark(c) for c in cells if table.delimiter != "," or not may_be_thousands(c))
        if counts["."] or counts[","]:
            return "," if counts[","] > counts["."] else "."
    return ""


def _no_table(
    choices: Sequence[tuple[str, list[CsvRow]]], encoding: str, options: ReadOptions, name: str
) -> InputError:
    if options.header_row is not None:
        what = f"line {options.header_row} is not a header with numbers below it"
        return InputError(Finding(name, what, remedy="set header_row to the line of the column names, counted from 1"))
    if not choices:
        remedy = (
            "export it with a column of times beside the values, or, if its rate is fixed, write "
            "'reading: {rate: 1 Hz}' and no 'time'; without a header the column is 'column 1'"
        )
        return InputError(Finding(name, f"has a single column: it contains no {_MARKS}", remedy=remedy))
    delimiter, records = max(choices, key=lambda c: max((len(r.fields) for r in c[1]), default=0))
    columns = numeric_columns(records)
    numbers = [r for r in records if is_numbers(r.fields, columns)]
    if numbers and numbers[0].line == 1:
        count = len(numbers[0].fields)
        remedy = f"write 'column 1' to 'column {count}' for its columns, or add a first line with their names"
        got = repr(delimiter.join(numbers[0].fields)[:60])
        return InputError(Finding(f"{name}:1", "has no header: the first line contains numbers", got, remedy))
    text = next((r for r in records if any(f.strip() for f in r.fields)), None)
    got = repr(decoded(delimiter.join(text.fields), encoding)[:60]) if text else ""
    if name.endswith((".yaml", ".yml")):
        return InputError(Finding(name, "is a description, not a log", remedy="remove it from the list of logs"))
    if any(is_value(f) for r in records for f in r.fields):
        remedy = "export it with a column of times beside the values, below a line of their names"
        return InputError(Finding(name, "contains no table with two columns of numbers", got, remedy))
    return InputError(Finding(name, "has no rows of data", got, "export the log again, with its data"))
