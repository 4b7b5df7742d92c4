"""Reading of a text log's numbers in blocks, into one array per column."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.clocks.written_times import since_first, written_seconds
from vdyn_cli.io.csv.csv_cells import COMPASS, LONGEST_NUMBER, NOT_WRITTEN, is_written, number_of
from vdyn_cli.io.csv.csv_layout import Layout
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, InputError

T = TypeVar("T", bound=np.generic)

MOST_BAD = 1000  # cells that are not numbers, after which reading stops
SMALL = 4_000_000  # bytes, which numpy reads in less time than it takes to import pandas, the faster reader

_WHITE = r"\s+"
_END_MARK = b"\x1a\0"  # as DOS programs write it, and zeros as of a logger that lost power
_TAIL = 1 << 16  # bytes at the end of a file that contain its last rows
_ALIKE = 10  # rows with the same number of decimals in their last cell, so that fewer are a cell cut off
_BLANK = b" \t\r\n"


@dataclass(frozen=True)
class BadCell:
    """A cell that is not a number; column -1 is a field after the last column."""

    row: int
    column: int
    text: str


@dataclass(frozen=True)
class Lines:
    """The file's line of each row; exact at the start of each block, and one line per row within it."""

    rows: tuple[int, ...]
    lines: tuple[int, ...]

    def of(self, row: int) -> int:
        """The line of the file, counted from 1, on which a row (counted from 0) stands."""
        block = int(np.searchsorted(self.rows, row, "right")) - 1
        return self.lines[block] + row - self.rows[block]


@dataclass(frozen=True)
class Numbers:
    """The numbers below the header.

    Parameters
    ----------
    columns : (n,) for each requested index, NaN where a cell is empty or not a number; s since the first for a column
        of times of day.
    bad : cells that are not numbers, in file order; reading stops after `MOST_BAD` of them.
    lines : the file's line of each row.
    grouped : number of cells with thousands separators.
    infinite : number of infinite cells, which count as empty.
    multiline : number of rows with a quoted line break, which make lines within a block approximate.
    begins : first time of each column of times of day: s since 1970, or since midnight if no date is stated.
    unfinished : whether the last row has no line end and too few fields, or fewer digits than the others.
    complete : whether the whole file was read.
    """

    columns: dict[int, Array]
    bad: tuple[BadCell, ...]
    lines: Lines
    grouped: int = 0
    infinite: int = 0
    multiline: int = 0
    unfinished: bool = False
    complete: bool = True
    begins: Mapping[int, float] = field(default_factory=dict)


class _Growing:
    """An array that grows; reserved memory is free until it is written."""

    def __init__(self) -> None:
        self._room: Array = np.empty(1 << 16)
        self._size = 0

    def extend(self, values: Array) -> None:
        size = self._size + values.size
        if size > self._room.size:
            room = np.empty(max(size, 2 * self._room.size))
            room[: self._size] = self._room[: self._size]
            self._room = room
        self._room[self._size : size] = values
        self._size = size

    @property
    def values(self) -> Array:
        return self._room[: self._size]


def read_numbers(
    blocks: Iterable[bytes], layout: Layout, positions: Sequence[int], encoding: str, name: str
) -> Numbers:
    """Read the columns at ``positions`` from blocks of whole lines, of which the first includes the header.

    Uses the memory of the requested columns, of one more column while growing, and of a few blocks.

    Parameters
    ----------
    layout, encoding : of the file. name : of the file, for messages.

    Raises
    ------
    InputError : a quote that is never closed.
    """
    beside = {p: at for p, at in layout.nanoseconds.items() if p in positions}
    positions = sorted({*positions, *beside.values()})
    growing = {p: _Growing() for p in positions}
    rows, lines = [0], [layout.first_line]
    bad: list[BadCell] = []
    grouped = infinite = multiline = row = 0
    line, skip, last = layout.first_line, layout.offset, b""
    for block in blocks:
        text, skip = block[skip:].rstrip(_END_MARK), 0
        if not text.strip(_BLANK):  # an empty block; as rows it would need a hundred times its size
            line += _count_lines(text) if text else 0
            rows.append(row)
            lines.append(line)
            continue
        table, cells, n_grouped = _parse(text, layout, positions, encoding, f"{name}:{line}")
        size, height = table[positions[0]].size, _count_lines(text)
        for position in positions:
            values, count = _finite(table[position])
            infinite += count
            growing[position].extend(values)
        bad += [BadCell(row + c.row, c.column, c.text) for c in cells]
        grouped, multiline = grouped + n_grouped, multiline + height - size
        row, line, last = row + size, line + height, (last + text[-_TAIL:])[-_TAIL:]
        rows.append(row)
        lines.append(line)
        if len(bad) > MOST_BAD:
            break
    written = {p: g.values[np.isfinite(g.values)] for p, g in growing.items() if p in layout.instants}
    begins = {p: float(values[0]) for p, values in written.items() if values.size}
    columns = {p: since_first(g.values) if p in layout.instants else g.values for p, g in growing.items()}
    columns |= {p: columns[p] + 1e-9 * columns[at] for p, at in beside.items()}
    where = Lines(tuple(rows), tuple(lines))
    unfinished = _unfinished(last, layout)
    return Numbers(columns, tuple(bad), where, grouped, infinite, multiline, unfinished, len(bad) <= MOST_BAD, begins)


def _finite(values: Array) -> tuple[Array, int]:
    """Values with infinite ones replaced by NaN, and the number of these."""
    infinite = np.isinf(values)
    count = int(np.count_nonzero(infinite))
    return (np.where(infinite, np.nan, values) if count else values), count


def _count_lines(text: bytes) -> int:
    ends = text.count(b"\n")
    if b"\r" in text:
        ends += text.count(b"\r") - text.count(b"\r\n")
    return ends + (not text.endswith((b"\n", b"\r")))


def _unfinished(text: bytes, layout: Layout) -> bool:
    """Whether the last row has no line end and too few fields, or fewer decimals than the last cells of rows above.

    ``text``: the end of the file.
    """
    *above, last = text.split(b"\n")
    if not last.strip():
        return False
    delimiter = layout.delimiter.encode()
    fields = len(last.split()) if layout.delimiter == " " else last.count(delimiter) + 1
    *others, own = (_decimals(line.rstrip().rpartition(delimiter)[2]) for line in [*above[-_ALIKE:], last])
    cut = len(others) == _ALIKE and len(set(others)) == 1 and own < others[0]
    return fields < len(layout.header) or (fields == len(layout.header) and cut)


def _decimals(cell: bytes) -> int:
    return len(cell) - 1 - max(cell.rfind(b"."), cell.rfind(b",")) if b"." in cell or b"," in cell else 0


def _parse(
    text: bytes, layout: Layout, positions: Sequence[int], encoding: str, where: str
) -> tuple[dict[int, Array], list[BadCell], int]:
    """One block as numbers, its bad cells, and the number of cells with thousands separators."""
    extra = len(layout.header)  # a field beyond the last column, to detect rows that are too long
    times = [p for p in positions if p in layout.instants]
    measured = [p for p in positions if p in layout.behind or p in layout.compass]
    numbers = [p for p in positions if p not in layout.instants and p not in measured]
    columns: dict[int, Array] = {}
    bad: list[BadCell] = []
    grouped = 0
    with_units = _frame(text, layout, measured, np.object_, where) if measured else {}
    for position, cells in with_units.items():
        bare = np.array([_plain(cell, layout.behind.get(position, "")) for cell in cells], dtype=object)
        columns[position], wrong, n = _converted(bare, layout.decimal)
        bad += [BadCell(i, position, _shown(cells[i], encoding)) for i in wrong]
        grouped += n
    beside = [of[p] for of in (layout.dates, layout.milliseconds) for p in times if p in of]
    written = _frame(text, layout, [*times, *beside], np.object_, where) if times else {}
    for position in times:
        cells = written[position]
        if position in layout.dates:
            cells = _dated(written[layout.dates[position]], cells)
        columns[position] = written_seconds(cells)
        if position in layout.milliseconds:
            milliseconds = _converted(written[layout.milliseconds[position]], layout.decimal)[0]
            columns[position] = columns[position] + 1e-3 * milliseconds
        unread = np.flatnonzero(np.isnan(columns[position]))
        bad += [BadCell(int(i), position, _shown(cells[i], encoding)) for i in unread if _holds(cells[i])]
    if (plain := _plain_numbers(text, layout, numbers)) is not None:
        return columns | plain, bad, grouped
    try:
        frame = _frame(text, layout, [*numbers, extra], np.float64, where)
        if np.isnan(frame[extra]).all():
            return columns | {p: frame[p] for p in numbers}, bad, grouped
    except ValueError:
        pass
    found = _frame(text, layout, [*numbers, extra], np.object_, where)
    for position in numbers:
        columns[position], wrong, n = _converted(found[position], layout.decimal)
        bad += [BadCell(i, position, _shown(found[position][i], encoding)) for i in wrong]
        grouped += n
    bad += [BadCell(i, -1, _shown(c, encoding)) for i, c in enumerate(found[extra]) if _holds(c)]
    return columns, sorted(bad, key=lambda c: (c.row, c.column)), grouped


def _plain_numbers(text: bytes, layout: Layout, positions: Sequence[int]) -> dict[int, Array] | None:
    """The columns of a small block in which every row has all fields and each of these is a number; else None."""
    fields = len(layout.header)
    comma = layout.decimal == ","
    if len(text) > SMALL or layout.delimiter == " " or b'"' in text or (comma and b"." in text) or not positions:
        return None
    text = text.replace(b",", b".") if comma else text
    rows = text.decode("latin-1").replace("\r\n", "\n").replace("\r", "\n").removesuffix("\n").split("\n")
    if not all(row and row.count(layout.delimiter) == fields - 1 for row in rows):
        return None
    try:
        read = np.loadtxt(rows, delimiter=layout.delimiter, comments=None, usecols=positions, ndmin=2)
    except ValueError:
        return None
    return {p: np.ascontiguousarray(column) for p, column in zip(positions, read.T, strict=True)}


def _frame(text: bytes, layout: Layout, positions: Sequence[int], dtype: type[T], where: str) -> dict[int, NDArray[T]]:
    import pandas as pd

    # The parser pads each row to the width of the previous one: a first row of full width makes all rows that wide.
    width = len(layout.header) + 1
    first = (layout.delimiter.join(["0"] * width) + "\n").encode()
    try:
        frame = pd.read_csv(
            io.BytesIO(first + text),
            sep=_WHITE if layout.delimiter == " " else layout.delimiter,
            header=None,
            names=range(width),
            usecols=list(positions),
            index_col=False,
            dtype=dtype,
            decimal=layout.decimal or ".",
            encoding="latin-1",
            engine="c",
            low_memory=False,
            skip_blank_lines=False,
            na_values=list(NOT_WRITTEN),
        )
    except pd.errors.ParserError:
        what = "a quote that opens at this line is not closed"
        raise InputError(Finding(where, what, remedy='remove the stray " or close it')) from None
    return {p: frame[p].to_numpy()[1:] for p in positions}


def _dated(days: NDArray[np.object_], times: NDArray[np.object_]) -> NDArray[np.object_]:
    """Cells (n,) of dates and of times of day as one text each; None where one of them is empty."""
    both = zip(days, times, strict=True)
    return np.array([f"{d.strip()} {t.strip()}" if _holds(d) and _holds(t) else None for d, t in both], dtype=object)


def _plain(cell: object, unit: str) -> object:
    """A cell without its unit, and the degrees of a point of the compass as text; other objects unchanged."""
    if not isinstance(cell, str):
        return cell
    bare = cell.strip()
    return bare.removesuffix(unit) if unit else f"{COMPASS[bare]:g}" if bare in COMPASS else bare


def _holds(cell: object) -> bool:
    """Whether a cell of text has a value."""
    return isinstance(cell, str) and is_written(cell)


def _shown(cell: object, encoding: str) -> str:
    return str(cell)[:LONGEST_NUMBER].encode("latin-1", "replace").decode(encoding, "replace").strip()


def _converted(cells: NDArray[np.object_], decimal: str) -> tuple[Array, list[int], int]:
    """Cells as numbers, the indices of cells that are not numbers, and the number with thousands separators."""
    values = np.full(cells.size, np.nan)
    wrong, grouped = [], 0
    for i, cell in enumerate(cells):
        if not isinstance(cell, str) or not is_written(cell):
            continue
        number, separated = number_of(cell, decimal)
        grouped += separated
        if number is None:
            wrong.append(i)
        else:
            values[i] = number
    return values, wrong, grouped
