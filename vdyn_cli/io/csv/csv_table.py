"""The table in the rows of a text log: quoting, the header, and where the numbers begin."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from itertools import pairwise, repeat, zip_longest
from typing import Literal

from vdyn_cli.io.clocks.written_times import is_day_or_minute, is_instant
from vdyn_cli.io.csv.csv_cells import decimal_mark, is_number, is_written, tidy, with_unit
from vdyn_cli.io.file_units import is_unit, unit_text
from vdyn_cli.io.reader import ReadOptions
from vdyn_cli.quantities.errors import LONGEST_NAME, MOST_COMPARED

_MOST_HEADS = 5  # rows of text above the numbers among which the header is searched
_MOST_BLOCKS = 10  # of rows of numbers, such as lap times among settings, above which a header is searched
_FEWEST_COUNTED = 3  # columns; a row "1, 2" may be a sample
MOST_SCORE = 2.0  # largest score of a table: all rows as wide as the header, all cells numbers
EXAMINED_ROWS = 200  # rows examined for the decimal mark
_JUDGED = 30  # rows at the end of the head that show which columns hold numbers; a preamble is seldom that long
_FEWEST_OF_ONE = 10  # rows of a file of one column, from which it may be a log
_LONGEST_RECORD = 8  # lines of a row; more are joined by a stray quote, such as that of 5" wheels
# Name, unit, range and rate in one cell of the header.
_BARRED = re.compile(r'"?([^"|]+)"?\|"?([^"|]*)"?(?:\|[^|]*){1,3}')
# Key, name, unit, digits and two switches, as the SD cards of VESC controllers have them.
_TAGGED = re.compile(r"[^\s:|]+:([^:|]+):([^:|]*):\d+:[01]:[01]")
_SECTION = re.compile(r"\s*\[[^\]]+\]\s*")  # such as [Channel Data], alone in its line
_COMMENT = ("#", "%")
_UNNAMED = "Unnamed: 0"  # the name by pandas of a column without one


@dataclass(frozen=True)
class CsvRow:
    """A row: the number of its first line, counted from 1, and its cells."""

    line: int
    fields: list[str]


@dataclass(frozen=True)
class CsvTable:
    """A table as it results with one delimiter.

    Parameters
    ----------
    header : names of the columns. header_line : number of its line, 0 without a header.
    between : rows between header and numbers, decoded. above : cells of the row above the header.
    barred : units in the cells of the header, after a bar or colon. numbers : rows of data.
    mapped : positions of the wanted columns. hits : number of wanted columns in the header.
    score : share of rows as wide as the header, plus share of cells with numbers.
    """

    delimiter: str
    header: list[str]
    between: list[CsvRow]
    above: list[str]
    barred: list[str]
    numbers: list[CsvRow]
    header_line: int
    mapped: tuple[int, ...]
    hits: int
    score: float


def ways_to_quote(lines: Sequence[str], delimiter: str) -> list[list[CsvRow]]:
    """Rows in which quoted cells may contain line ends; if any do, also rows in which a quote is an ordinary
    character, since two stray quotes in the head of a file look like one long cell."""
    quoted, longest = _records(lines, delimiter, csv.QUOTE_MINIMAL)
    if longest == 1:
        return [quoted]
    plain = _records(lines, delimiter, csv.QUOTE_NONE)[0]
    return [quoted, plain] if longest <= _LONGEST_RECORD else [plain]


def table_with_header(
    delimiter: str, records: list[CsvRow], encoding: str, wanted: Sequence[str], options: ReadOptions
) -> CsvTable | None:
    """The table that results with this delimiter; None if there is none.

    Parameters
    ----------
    records : split at the delimiter. wanted : names of the mapped columns, by which the header is found.
    options : of the reading, such as the line of the header.
    """
    records = _without_comment_marks(records, wanted)
    cells = [_names(r.fields, encoding, wanted) for r in records]
    cells = [cells[0], *map(_of_two_rows, cells, cells[1:], repeat(frozenset(wanted)))] if cells else []
    hits = [len(set(wanted).intersection(row)) for row in cells]
    if options.header_row is not None:
        at = next((i for i, r in enumerate(records) if r.line == options.header_row), None)
    elif any(hits):
        at = hits.index(max(hits))
    else:
        at = _likely_header(records, cells, wanted)
    if at is None:
        return None
    header = cells[at]
    # A table of split times may begin with levels that no vehicle passed.
    clock = header.index(wanted[0]) if wanted and wanted[0] in header and options.split_times is None else None
    start = _first_of_numbers(records, at + 1, len(header), clock)
    if start is None or len(header) < 2:
        return None
    between = [CsvRow(r.line, [decoded(f, encoding) for f in r.fields]) for r in records[at + 1 : start]]
    numbers = records[start:]
    if between and len(between[0].fields) == len(numbers[0].fields) and holds_units(between[0].fields):
        header = [*header, *between[0].fields[len(header) :]]  # columns named only in the units row
    for row in between:  # some names are a row below the others, such as TIME above each group of columns
        header = [
            name or (below if not is_unit(unit_text(below)) else "") for name, below in _padded(header, row.fields)
        ]
    shares = [_share_of_numbers(r.fields) for r in numbers[:30]]
    fitting = sum(len(r.fields) == len(header) for r in numbers[:30]) / len(shares)
    mapped = tuple(i for i, cell in enumerate(header) if cell in wanted)
    score = fitting + sum(shares) / len(shares)
    above = cells[at - 1] if at > 0 and len(cells[at - 1]) == len(header) else []
    own = [_with_its_unit(decoded(f, encoding)) for f in records[at].fields]
    barred = [unit_text(m[2]) if m else "" for m in own]
    return CsvTable(delimiter, header, between, above, barred, numbers, records[at].line, mapped, hits[at], score)


def _without_comment_marks(records: list[CsvRow], wanted: Sequence[str]) -> list[CsvRow]:
    """The rows; above the numbers without the mark # or % of a comment, and without a word such as "columns:".

    The names of columns may begin with such a mark themselves: a mark that is a cell is one where the row has a cell
    more than the numbers, and another one where all rows above the numbers have it.
    """
    columns = numeric_columns(records)
    first = next((i for i, r in enumerate(records) if len(r.fields) > 1 and is_numbers(r.fields, columns)), 0)
    width, above = len(records[first].fields) if records else 0, [r.fields for r in records[:first] if any(r.fields)]
    begins = [tidy(fields[0]) for fields in above]
    if not any(cell.startswith(_COMMENT) for cell in begins) or any(cell in wanted for cell in begins):
        return records
    everywhere = all(cell.startswith(_COMMENT) for cell in begins)
    uncommented = []
    for row in records[:first]:
        fields = row.fields
        if fields and tidy(fields[0]) in _COMMENT and len(fields) > width:
            fields = fields[1:]
        elif fields and everywhere and tidy(fields[0]) not in _COMMENT:
            fields = [tidy(fields[0]).lstrip("".join(_COMMENT)).strip(), *fields[1:]]
        if len(fields) == width + 1 and fields[0].endswith(":"):
            fields = fields[1:]
        uncommented.append(CsvRow(row.line, fields))
    return [*uncommented, *records[first:]]


def _padded(header: Sequence[str], fields: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Each name of a header with the cell below it, empty where that row is shorter."""
    return zip(header, [*fields, *[""] * len(header)], strict=False)


def _first_of_numbers(records: Sequence[CsvRow], after: int, width: int, clock: int | None) -> int | None:
    """The index of the first row of data from ``after`` on, below a row that numbers the columns; None without any."""
    below, columns = range(after, len(records)), numeric_columns(records)
    start = next((i for i in below if is_numbers(records[i].fields, columns, clock)), None)
    if start is None:  # the clock may be text, which gets a specific message
        start = next((i for i in below if is_numbers(records[i].fields, columns)), None)
    if start is None:
        return None
    if start + 1 < len(records) and _counts_columns(records[start].fields, records[start + 1].fields, width):
        start += 1
    while start + 1 < len(records) and not any(map(is_written, records[start].fields)):
        start += 1
    return start


def table_without_header(choices: Sequence[tuple[str, list[CsvRow]]], wanted: Sequence[str]) -> CsvTable | None:
    """A table that begins with numbers, its columns named by number; None if other names are wanted."""
    tables: list[tuple[float, int, str, list[CsvRow]]] = []
    for delimiter, records in choices:
        first = [r for r in records if any(map(is_written, r.fields))][:EXAMINED_ROWS]
        columns = numeric_columns(records)
        widths = {len(r.fields) for r in first}
        if len(first) > 1 and len(widths) == 1 and widths != {1} and all(is_numbers(r.fields, columns) for r in first):
            least = min(_share_of_numbers(r.fields) for r in first)
            tables.append((least, widths.pop(), delimiter, records))
    if not tables:
        return None
    share, width, delimiter, records = max(tables, key=lambda t: t[:2])
    header = [f"column {i + 1}" for i in range(width)]
    mapped = tuple(i for i, cell in enumerate(header) if cell in wanted)
    if wanted and not mapped:
        return None
    return CsvTable(delimiter, header, [], [], [""] * width, records, 0, mapped, len(mapped), share)


def single_column(delimiter: str, records: list[CsvRow], encoding: str, wanted: Sequence[str]) -> CsvTable | None:
    """A table of one column of numbers, whose rows have a fixed rate; None if it is none, or other names are wanted."""
    written = [i for i, r in enumerate(records) if any(map(is_written, r.fields))]
    first = next((i for i in written if is_value(records[i].fields[0])), None)
    if first is None or not all(is_value(records[i].fields[0]) for i in written if i > first):
        return None
    above = [records[i] for i in written if i < first]
    name = decoded(above[-1].fields[0], encoding) if above else "column 1"
    mapped = (0,) if name in wanted else ()
    if len(above) > 1 or len(records) - first < _FEWEST_OF_ONE or (wanted and not mapped):
        return None
    line = above[0].line if above else 0
    return CsvTable(delimiter, [name], [], [], [""], records[first:], line, mapped, len(mapped), 1.0)


def numeric_columns(records: Sequence[CsvRow]) -> dict[int, bool]:
    """The columns with numbers in most written cells of the last rows, and whether these have units (``35 km/h``).

    The others hold text, such as a message name.
    """
    found: dict[int, bool] = {}
    for i, cells in enumerate(zip_longest(*(r.fields for r in records[-_JUDGED:]), fillvalue="")):
        written = [cell for cell in cells if is_written(cell)]
        with_units = 2 * sum(bool(unit_behind(cell)) for cell in written) > len(written)
        if with_units or _share_of_numbers(written) > 0.5:
            found[i] = with_units
    return found


def is_numbers(fields: Sequence[str], columns: Mapping[int, bool], clock: int | None = None) -> bool:
    """Whether a row is data: a number in the clock, most of its cells, or two ``columns`` that usually hold numbers."""
    if clock is not None:
        return clock < len(fields) and is_value(fields[clock])
    if _share_of_numbers(fields) > 0.5:
        return True
    own = [(fields[i], with_unit) for i, with_unit in columns.items() if i < len(fields) and is_written(fields[i])]
    known = sum(is_value(cell) or (with_unit and bool(unit_behind(cell))) for cell, with_unit in own)
    return 2 * known > len(own) and known > 1


def is_value(cell: str) -> bool:
    """Whether a cell holds a number, a time of day, a date, or minutes and seconds."""
    return is_number(cell) or is_instant(cell) or is_day_or_minute(cell)


def unit_behind(cell: str) -> str:
    """The unit in a cell such as ``35 km/h``; empty for other cells."""
    both = with_unit(cell)
    return both[1] if both is not None and is_unit(both[1]) else ""


def holds_units(fields: Sequence[str], share: float = 0.5) -> bool:
    """Whether at least this share of the written cells are units."""
    written = [unit_text(f) for f in fields if is_written(f)]
    known = sum(is_unit(f) for f in written)
    return known > 0 and known >= share * len(written)


def decoded(cell: str, encoding: str) -> str:
    """The text of a cell that was read as Latin-1, without blanks around it and without a byte order mark."""
    return tidy(cell.encode("latin-1").decode(encoding, "replace").removeprefix("\ufeff"))


def _records(lines: Sequence[str], delimiter: str, quoting: Literal[0, 3]) -> tuple[list[CsvRow], int]:
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
            records.append(CsvRow(line, fields))
            longest = max(longest, reader.line_num + 1 - line)
            line = reader.line_num + 1
    except csv.Error:
        return [], _LONGEST_RECORD + 1
    return records, longest


def _names(fields: Sequence[str], encoding: str, wanted: Sequence[str]) -> list[str]:
    """The cells as column names; empty for a row that begins with a number, so that data are not decoded."""
    if not fields or is_value(fields[0]):
        return []
    names = [decoded(f, encoding) for f in fields]
    names = [m[1] if (m := _with_its_unit(name)) else name for name in names]
    if not names[0] and any(names):
        names[0] = _UNNAMED
    if names[0] not in wanted and len(names[0]) > 1:
        names[0] = names[0].lstrip("#%").strip()
    return names


def _of_two_rows(above: list[str], own: list[str], wanted: Collection[str]) -> list[str]:
    """The names of a header, joined with those of the row above it where only both together differ.

    Stations write Wind and Hi above two columns Speed. A description may name the columns by the lower row alone.
    """
    if len(above) != len(own) or _differ(above) or _differ(own) or holds_units(own) or any(map(is_value, own)):
        return own
    joined = [" ".join(two).removeprefix(_UNNAMED).strip() for two in zip(above, own, strict=True)]
    used = {name.partition("#")[0] for name in wanted} & (set(own) - set(joined))
    return joined if _differ(joined) and not holds_units(above) and not used else own


def _differ(names: Sequence[str]) -> bool:
    """Whether no two names are equal; empty ones do not count."""
    written = [name for name in names if name]
    return len(set(written)) == len(written)


def _with_its_unit(cell: str) -> re.Match[str] | None:
    """The match of a header cell that holds a name and its unit, as groups 1 and 2; None for other cells."""
    return _BARRED.fullmatch(cell) or _TAGGED.fullmatch(cell)


def _likely_header(records: list[CsvRow], cells: list[list[str]], wanted: Sequence[str]) -> int | None:
    """The index of the text row above the numbers that resembles the wanted names most, or else has most names.

    Settings above a table also contain numbers; the table's rows have the most frequent number of cells.
    """
    columns = numeric_columns(records)
    rows = [i for i, r in enumerate(records) if len(r.fields) > 1 and is_numbers(r.fields, columns)]
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


def _header_above(first: int, records: list[CsvRow], cells: list[list[str]], wanted: Sequence[str]) -> int | None:
    """The index of the header of the table whose numbers begin at row ``first``; None if there is none."""
    width = len(records[first].fields)
    rows: list[int] = []
    for i in range(first - 1, -1, -1):
        if not any(map(is_written, records[i].fields)):
            continue  # some loggers write empty lines between header, units and numbers
        if not rows and (width > 2 or _is_section(records[i].fields)) and _is_remark(records[i].fields):
            continue
        if not cells[i] or len(rows) == _MOST_HEADS:
            break
        if abs(len(cells[i]) - width) > 1 or (len(cells[i]) < width and any(map(is_number, cells[i]))):
            more_units = rows and holds_units(cells[rows[-1]]) and width / 2 < len(cells[i]) < width
            if more_units and not any(map(is_number, cells[i])):
                rows.append(i)  # the units row names further columns
            break
        rows.append(i)
    units = [i for i in rows if holds_units(cells[i])]
    # Comments on the columns may stand below their units, but their names do not.
    names = [i for i in rows if i not in units and (not units or i < units[0])]
    names = names or [i for i in rows if i not in units] or rows

    def likeness(i: int) -> tuple[float, int, int]:
        named = {cell for cell in cells[i] if is_written(cell)}
        return sum(_resemblance(w, cells[i]) for w in wanted), len(named), -sum(map(is_unit, named))

    return max(names, key=likeness, default=None)


def _is_section(fields: Sequence[str]) -> bool:
    return _SECTION.fullmatch("".join(fields)) is not None


def _is_remark(fields: Sequence[str]) -> bool:
    """Whether a row has a single text, such as [Channel Data] or the start of the log, and so names no columns."""
    return sum(map(is_written, fields)) == 1


def _resemblance(name: str, cells: Sequence[str]) -> float:
    some = (cell[:LONGEST_NAME].lower() for cell in cells[:MOST_COMPARED])
    return max(SequenceMatcher(None, name[:LONGEST_NAME].lower(), cell).ratio() for cell in some)


def _counts_columns(fields: Sequence[str], below: Sequence[str], width: int) -> bool:
    """Whether a row below the header numbers the columns: 1, 2, 3 and so on, or 0, 1, 2 where the numbers of the row
    ``below`` have decimals, since a first sample is often at 0."""
    if len(fields) < max(width, _FEWEST_COUNTED):
        return False
    begin = 0 if all(map(decimal_mark, filter(is_number, below))) else 1
    return any(all(f.strip() == str(i + n) for i, f in enumerate(fields)) for n in {begin, 1})


def _share_of_numbers(fields: Sequence[str]) -> float:
    written = [f for f in fields if is_written(f)]
    return sum(map(is_value, written)) / len(written) if written else 0.0
