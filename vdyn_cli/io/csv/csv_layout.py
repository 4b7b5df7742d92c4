"""Detection of a text log's layout: delimiter, decimal mark, and lines of header, units and numbers."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import SequenceMatcher
from itertools import pairwise, zip_longest
from typing import Literal

from vdyn_cli.io.clocks.written_times import is_day_or_minute, is_instant
from vdyn_cli.io.csv.csv_cells import decimal_mark, is_number, is_written, tidy
from vdyn_cli.io.file_units import is_unit, unit_text
from vdyn_cli.io.reader import ReadOptions
from vdyn_cli.quantities.errors import LONGEST_NAME, MOST_COMPARED, Finding, InputError

# Bytes and lines to examine: the first suffices if it has the wanted columns, the last is for files with thousands of
# columns.
_HEADS = ((1 << 15, 250), (1 << 16, 1000), (1 << 20, 1000))
_MOST_HEADS = 5  # rows of text above the numbers among which the header is searched
_MOST_BLOCKS = 10  # of rows of numbers, such as lap times among settings, above which a header is searched
_FEWEST_COUNTED = 3  # columns; a row "1, 2" may be a sample
_FEWEST_UNITS = 0.3  # least share of units in a row of units between header and numbers
_SHOWN = 200  # rows examined for the decimal mark
_JUDGED = 30  # rows at the end of the head that show which columns hold numbers; a preamble is seldom that long
_DELIMITERS = (";", "\t", ",", "|", " ")
_LONGEST_RECORD = 8  # lines of a row; more are joined by a stray quote, such as that of 5" wheels
_MILLISECONDS = re.compile(r"\W*(ms|msecs?|millis|milliseconds?)\W*", re.IGNORECASE)
_BARRED = re.compile(
    r'"?([^"|]+)"?\|"?([^"|]*)"?(?:\|[^|]*){1,3}'
)  # name, unit, range and rate in one cell of the header
_MARKS = "comma, semicolon, tab, bar or blank"
_UNNAMED = "Unnamed: 0"  # the name by pandas of a column without one
_STAMP = re.compile(r"(.*?)(?:sec|secs|seconds)\n\1(?:nanosec|nsec|nsecs|nanoseconds)")  # names of two columns
_STATED = re.compile(r'"?sep=([^"\r\n])"?[;,\t]*\s*', re.IGNORECASE)  # first line of a file for Excel
_NAMED = {"tab": "\t", "\\t": "\t", "space": " ", "blank": " ", "comma": ",", "semicolon": ";", "pipe": "|"}


@dataclass(frozen=True)
class Layout:
    """Layout of a text log; ``decimal`` is empty if the head of the file has only whole numbers.

    ``instants``: indices of columns of times of day, with or without date; ``milliseconds``: index of such a column to
    that of the column with its milliseconds. ``nanoseconds``: the same for columns of seconds. ``sources``: texts of a
    row below the header that are not units, such as the devices; as long as the header, or empty.
    """

    delimiter: str
    decimal: str
    header: tuple[str, ...]
    header_line: int  # 0 without a header
    units: tuple[str, ...]  # as long as the header, or empty where there is no units row
    first_line: int  # of the numbers, counted from 1
    offset: int  # byte at which the numbers begin
    instants: frozenset[int] = frozenset()
    milliseconds: Mapping[int, int] = field(default_factory=dict)
    nanoseconds: Mapping[int, int] = field(default_factory=dict)
    sources: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True)
class _Record:
    line: int
    fields: list[str]


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
    for size, most in _HEADS:
        lines = head[:size].splitlines(keepends=True)
        if len(head) > size:
            lines = lines[:-1]
        part = len(head) > size or len(lines) > most
        lines = lines[:most]
        # Latin-1 gives one character per byte for any encoding; header cells are decoded separately.
        text = [line.decode("latin-1") for line in lines]
        choices = [(d, records) for d in _delimiters(options, text, name) for records in _ways_to_quote(text, d)]
        tables = [t for d, records in choices if (t := _table(d, records, encoding, wanted, options)) is not None]
        table = max(tables, key=lambda t: (t.hits, t.score), default=None)
        if table is not None and (most > _HEADS[0][1] or not part or 0 < table.hits == len(set(wanted))):
            return _layout(table, [len(line) for line in lines], options, name)
        if not part:
            break
    bare = _without_header(choices, wanted) if options.header_row is None else None
    if bare is not None:
        return _layout(bare, [len(line) for line in lines], options, name)
    raise _no_table(choices, encoding, options, name)


def _without_header(choices: Sequence[tuple[str, list[_Record]]], wanted: Sequence[str]) -> _Table | None:
    """A table that begins with numbers, its columns named by number; None if other names are wanted."""
    tables: list[tuple[float, int, str, list[_Record]]] = []
    for delimiter, records in choices:
        first = [r for r in records if any(map(is_written, r.fields))][:_SHOWN]
        columns = _numeric_columns(records)
        widths = {len(r.fields) for r in first}
        if len(first) > 1 and len(widths) == 1 and widths != {1} and all(_is_numbers(r.fields, columns) for r in first):
            least = min(_share_of_numbers(r.fields) for r in first)
            tables.append((least, widths.pop(), delimiter, records))
    if not tables:
        return None
    share, width, delimiter, records = max(tables, key=lambda t: t[:2])
    header = [f"column {i + 1}" for i in range(width)]
    mapped = tuple(i for i, cell in enumerate(header) if cell in wanted)
    if wanted and not mapped:
        return None
    return _Table(delimiter, header, [], [], [""] * width, records, 0, mapped, len(mapped), share)


def _delimiters(options: ReadOptions, lines: Sequence[str], name: str) -> list[str]:
    if options.delimiter is None:
        return [d for d in _DELIMITERS if any(d in line for line in lines)]
    given = _NAMED.get(options.delimiter.lower(), options.delimiter)
    if len(given) != 1 or given in '\r\n"' or ord(given) > 126 or given.isalnum():
        remedy = "use one character, or the words tab, space, comma, semicolon"
        raise InputError(Finding(name, "cannot be a delimiter", repr(options.delimiter), remedy))
    return [given]


def _ways_to_quote(lines: Sequence[str], delimiter: str) -> list[list[_Record]]:
    """Rows in which quoted cells may contain line ends; if any do, also rows in which a quote is an ordinary
    character, since two stray quotes in the head of a file look like one long cell."""
    quoted, longest = _records(lines, delimiter, csv.QUOTE_MINIMAL)
    if longest == 1:
        return [quoted]
    plain = _records(lines, delimiter, csv.QUOTE_NONE)[0]
    return [quoted, plain] if longest <= _LONGEST_RECORD else [plain]


def _records(lines: Sequence[str], delimiter: str, quoting: Literal[0, 3]) -> tuple[list[_Record], int]:
    """Rows with their first lines, and the number of lines of the longest row; no rows if a quote is not closed."""
    reader = csv.reader(
        (line.strip(" ") if delimiter == " " else line for line in lines),
        delimiter=delimiter,
        skipinitialspace=delimiter == " ",
        quoting=quoting,
    )
    records, line, longest = [], 1, 1
    try:
        for fields in reader:
            records.append(_Record(line, fields))
            longest = max(longest, reader.line_num + 1 - line)
            line = reader.line_num + 1
    except csv.Error:
        return [], _LONGEST_RECORD + 1
    return records, longest


@dataclass(frozen=True)
class _Table:
    delimiter: str
    header: list[str]
    between: list[_Record]  # rows between header and numbers, decoded
    above: list[str]  # cells of the row above the header
    barred: list[str]  # units in the cells of the header, after a bar
    numbers: list[_Record]
    header_line: int
    mapped: tuple[int, ...]  # positions of wanted columns that were found
    hits: int
    score: float


def _table(
    delimiter: str, records: list[_Record], encoding: str, wanted: Sequence[str], options: ReadOptions
) -> _Table | None:
    """The table that results with this delimiter; None if there is none."""
    cells = [_names(r.fields, encoding, wanted) for r in records]
    hits = [len(set(wanted).intersection(row)) for row in cells]
    at: int | None
    if options.header_row is not None:
        at = next((i for i, r in enumerate(records) if r.line == options.header_row), None)
    elif any(hits):
        at = max(range(len(records)), key=lambda i: hits[i])
    else:
        at = _likely_header(records, cells, wanted)
    if at is None:
        return None
    header = cells[at]
    if header[0] in ("#", "%") and at + 1 < len(records) and len(header) == len(records[at + 1].fields) + 1:
        header = header[1:]  # a header written as a comment
    # A table of split times may begin with levels that no vehicle passed.
    clock = header.index(wanted[0]) if wanted and wanted[0] in header and options.split_times is None else None
    below = range(at + 1, len(records))
    columns = _numeric_columns(records)
    start = next((i for i in below if _is_numbers(records[i].fields, columns, clock)), None)
    if start is None:  # the clock may be text, which gets a specific message
        start = next((i for i in below if _is_numbers(records[i].fields, columns)), None)
    if start is None or len(header) < 2:
        return None
    if _counts_columns(records[start].fields, len(header)) and start + 1 < len(records):
        start += 1
    while start + 1 < len(records) and not any(map(is_written, records[start].fields)):
        start += 1
    between = [_Record(r.line, [_decoded(f, encoding) for f in r.fields]) for r in records[at + 1 : start]]
    numbers = records[start:]
    if between and len(between[0].fields) == len(numbers[0].fields) and _holds_units(between[0].fields):
        header = [*header, *between[0].fields[len(header) :]]  # columns named only in the units row
    shares = [_share_of_numbers(r.fields) for r in numbers[:30]]
    fitting = sum(len(r.fields) == len(header) for r in numbers[:30]) / len(shares)
    mapped = tuple(i for i, cell in enumerate(header) if cell in wanted)
    score = fitting + sum(shares) / len(shares)
    above = cells[at - 1] if at > 0 and len(cells[at - 1]) == len(header) else []
    own = [_BARRED.fullmatch(_decoded(f, encoding)) for f in records[at].fields]
    barred = [unit_text(m[2]) if m else "" for m in own]
    return _Table(delimiter, header, between, above, barred, numbers, records[at].line, mapped, hits[at], score)


def _names(fields: Sequence[str], encoding: str, wanted: Sequence[str]) -> list[str]:
    """The cells as column names; empty for a row that begins with a number, so that data are not decoded."""
    if not fields or _is_value(fields[0]):
        return []
    names = [_decoded(f, encoding) for f in fields]
    names = [m[1] if (m := _BARRED.fullmatch(name)) else name for name in names]
    if not names[0] and any(names):
        names[0] = _UNNAMED
    if names[0] not in wanted and len(names[0]) > 1:
        names[0] = names[0].lstrip("#%").strip()
    return names


def _decoded(cell: str, encoding: str) -> str:
    return tidy(cell.encode("latin-1").decode(encoding, "replace").removeprefix("\ufeff"))


def _likely_header(records: list[_Record], cells: list[list[str]], wanted: Sequence[str]) -> int | None:
    """The index of the text row above the numbers that resembles the wanted names most, or else has most names.

    Settings above a table also contain numbers; the table's rows have the most frequent number of cells.
    """
    columns = _numeric_columns(records)
    rows = [i for i, r in enumerate(records) if len(r.fields) > 1 and _is_numbers(r.fields, columns)]
    widths = Counter(len(records[i].fields) for i in rows)
    usual = max(widths, key=lambda w: widths[w], default=0)
    numeric = set(rows)
    written = [i for i, r in enumerate(records) if any(map(is_written, r.fields))]
    begins = [i for above, i in pairwise([-1, *written]) if i in numeric and above not in numeric]
    below = dict(pairwise(written))
    begins = [i for i in begins if below.get(i, i) in numeric] or begins
    firsts = [i for i in begins if len(records[i].fields) == usual][:_MOST_BLOCKS]
    firsts += [next(i for i in rows if len(records[i].fields) in (usual, n)) for n in widths]
    headers = (_header_above(first, records, cells, wanted) for first in dict.fromkeys(firsts))
    return next((at for at in headers if at is not None), None)


def _header_above(first: int, records: list[_Record], cells: list[list[str]], wanted: Sequence[str]) -> int | None:
    """The index of the header of the table whose numbers begin at row ``first``; None if there is none."""
    width = len(records[first].fields)
    rows: list[int] = []
    for i in range(first - 1, -1, -1):
        if not any(map(is_written, records[i].fields)):
            continue  # some loggers write empty lines between header, units and numbers
        if not cells[i] or len(rows) == _MOST_HEADS:
            break
        if abs(len(cells[i]) - width) > 1 or (len(cells[i]) < width and any(map(is_number, cells[i]))):
            if rows and _holds_units(cells[rows[-1]]) and width / 2 < len(cells[i]) < width:
                rows.append(i)  # the units row names further columns
            break
        rows.append(i)
    names = [i for i in rows if not _holds_units(cells[i])] or rows

    def likeness(i: int) -> tuple[float, int, int]:
        named = {cell for cell in cells[i] if is_written(cell)}
        return sum(_resemblance(w, cells[i]) for w in wanted), len(named), -sum(map(is_unit, named))

    return max(names, key=likeness, default=None)


def _resemblance(name: str, cells: Sequence[str]) -> float:
    some = (cell[:LONGEST_NAME].lower() for cell in cells[:MOST_COMPARED])
    return max(SequenceMatcher(None, name[:LONGEST_NAME].lower(), cell).ratio() for cell in some)


def _is_numbers(fields: Sequence[str], columns: Sequence[int], clock: int | None = None) -> bool:
    """Whether a row is data: a number in the clock, most of its cells, or two ``columns`` that usually hold numbers."""
    if clock is not None:
        return clock < len(fields) and _is_value(fields[clock])
    if _share_of_numbers(fields) > 0.5:
        return True
    own = [fields[i] for i in columns if i < len(fields)]
    return _share_of_numbers(own) > 0.5 and sum(map(_is_value, own)) > 1


def _numeric_columns(records: Sequence[_Record]) -> list[int]:
    """The columns with numbers in most written cells of the last rows; the others hold text, such as a message name."""
    columns = zip_longest(*(r.fields for r in records[-_JUDGED:]), fillvalue="")
    return [i for i, cells in enumerate(columns) if _share_of_numbers(cells) > 0.5]


def _counts_columns(fields: Sequence[str], width: int) -> bool:
    """Whether a row below the header numbers the columns: 1, 2, 3 and so on."""
    return len(fields) >= max(width, _FEWEST_COUNTED) and all(f.strip() == str(i + 1) for i, f in enumerate(fields))


def _share_of_numbers(fields: Sequence[str]) -> float:
    written = [f for f in fields if is_written(f)]
    return sum(map(_is_value, written)) / len(written) if written else 0.0


def _is_value(cell: str) -> bool:
    return is_number(cell) or is_instant(cell) or is_day_or_minute(cell)


def _instants(table: _Table) -> frozenset[int]:
    """The columns in which most of the first cells are times of day."""
    first = [record.fields for record in table.numbers[:30]]
    columns = range(len(table.header))
    return frozenset(i for i in columns if 2 * sum(i < len(f) and is_instant(f[i]) for f in first) > len(first))


def _layout(table: _Table, lengths: Sequence[int], options: ReadOptions, name: str) -> Layout:
    first = table.numbers[0].line
    units, skipped = _units_row(table)
    skipped_rows = tuple(
        Finding(f"{name}:{r.line}", "row between header and numbers skipped", repr(table.delimiter.join(r.fields)[:60]))
        for r in skipped[:3]
    )
    sources = next((tuple(r.fields) for r in skipped if len(r.fields) == len(table.header)), ())
    instants = _instants(table)
    return Layout(
        table.delimiter,
        options.decimal or _decimal(table),
        tuple(table.header),
        table.header_line,
        units,
        first,
        sum(lengths[: first - 1]),
        instants,
        {i: i + 1 for i in instants if _MILLISECONDS.fullmatch("".join(table.header[i + 1 : i + 2]))},
        {i: i + 1 for i, two in enumerate(pairwise(table.header)) if _STAMP.fullmatch("\n".join(two))},
        sources,
        skipped_rows,
    )


def _units_row(table: _Table) -> tuple[tuple[str, ...], list[_Record]]:
    """The units, from a row between header and numbers, or the header; and the other, skipped rows between them."""
    rows = [r for r in table.between if any(f.strip() for f in r.fields)]
    units: tuple[str, ...] = ()
    stated = next((r for r in rows if _holds_units(r.fields, _FEWEST_UNITS)), None)
    if stated is not None:
        cells = [unit_text(f) for f in stated.fields]
        units = tuple((cells + [""] * len(table.header))[: len(table.header)])
        rows.remove(stated)
    elif any(table.barred):
        units = tuple(table.barred)
    elif table.above and _holds_units(table.above) and not _holds_units(table.header):
        units = tuple(unit_text(f) for f in table.above)
    return units, rows


def _holds_units(fields: Sequence[str], share: float = 0.5) -> bool:
    written = [unit_text(f) for f in fields if is_written(f)]
    known = sum(is_unit(f) for f in written)
    return known > 0 and known >= share * len(written)


def _decimal(table: _Table) -> str:
    """The decimal mark of most numbers in the mapped columns; empty if they are whole numbers."""
    counts = {".": 0, ",": 0, "": 0}
    for record in table.numbers[:_SHOWN]:
        for i in table.mapped or range(len(record.fields)):
            if i < len(record.fields):
                counts[decimal_mark(record.fields[i])] += 1
    if not counts["."] and not counts[","]:
        return ""
    return "," if counts[","] > counts["."] else "."


def _no_table(
    choices: Sequence[tuple[str, list[_Record]]], encoding: str, options: ReadOptions, name: str
) -> InputError:
    if options.header_row is not None:
        what = f"line {options.header_row} is not a header with numbers below it"
        return InputError(Finding(name, what, remedy="set header_row to the line of the column names, counted from 1"))
    if not choices:
        remedy = "export it with a column of times beside the values; a first line names both, such as time_s,speed_kmh"
        return InputError(Finding(name, f"has a single column: it contains no {_MARKS}", remedy=remedy))
    delimiter, records = max(choices, key=lambda c: max((len(r.fields) for r in c[1]), default=0))
    columns = _numeric_columns(records)
    numbers = [r for r in records if _is_numbers(r.fields, columns)]
    if numbers and numbers[0].line == 1:
        count = len(numbers[0].fields)
        remedy = f"write 'column 1' to 'column {count}' for its columns, or add a first line with their names"
        got = repr(delimiter.join(numbers[0].fields)[:60])
        return InputError(Finding(f"{name}:1", "has no header: the first line contains numbers", got, remedy))
    text = next((r for r in records if any(f.strip() for f in r.fields)), None)
    got = repr(_decoded(delimiter.join(text.fields), encoding)[:60]) if text else ""
    if name.endswith((".yaml", ".yml")):
        return InputError(Finding(name, "is a description, not a log", remedy="remove it from the list of logs"))
    if any(_is_value(f) for r in records for f in r.fields):
        remedy = "export it with a column of times beside the values, below a line of their names"
        return InputError(Finding(name, "contains no table with two columns of numbers", got, remedy))
    return InputError(Finding(name, "has no rows of data", got, "export the log again, with its data"))
