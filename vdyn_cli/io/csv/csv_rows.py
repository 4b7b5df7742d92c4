"""Selection of a table's data rows: removes and reports a summary below, blank rows and an incomplete last line."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.io.clocks.appended_recordings import restarts
from vdyn_cli.io.clocks.sample_times import lines_of
from vdyn_cli.io.clocks.written_times import FORMS
from vdyn_cli.io.csv.csv_cells import may_be_thousands, tidy
from vdyn_cli.io.csv.csv_layout import Layout
from vdyn_cli.io.csv.csv_numbers import MOST_BAD, BadCell, Numbers
from vdyn_cli.io.file_units import unit_text
from vdyn_cli.quantities.arrays import Array, Mask, Rows
from vdyn_cli.quantities.errors import Finding

_MOST_SUMMARY = 50  # rows below the data that may be a bench's summary
_OF_DAY = re.compile(r"\d+:\d\d|\d{4}-\d\d-\d\d|\d\d?[./]\d\d?[./]\d{2,4}")
_EITHER_MARK = re.compile(r"[+-]?\d+[.,]\d+([eE][+-]?\d+)?")


@dataclass(frozen=True)
class DataRows:
    """The data rows ``kept`` (None: all up to ``stop``), findings on removed rows, and problems."""

    stop: int
    kept: Rows | None
    findings: tuple[Finding, ...]
    problems: tuple[Finding, ...]


def data_rows(
    numbers: Numbers, layout: Layout, position: Mapping[str, int], name: str, joined: bool = False
) -> DataRows:
    """Separate the data from other rows below a header.

    The data end at the last row with a time and only numbers; up to 50 rows after it are a summary. Text in a row
    before it is a problem, as is a row longer than the header.

    Parameters
    ----------
    numbers : the cells below the header. layout : of the table. position : index of each channel's column.
    name : of the file, for messages.
    joined : the file has several recordings, each of which may begin with the header.
    """
    clock = _clock(position)
    time = numbers.columns[clock]
    line_of = numbers.lines.of
    again = _repeated_headers(numbers.bad, layout, time, joined)
    marks = [row for row in _rows_of_text(numbers, clock) if row not in again]
    bad = tuple(c for c in numbers.bad if c.row not in {*again, *marks})
    bad_rows = np.unique(np.array([c.row for c in bad], dtype=np.intp))
    good = ~np.isnan(time)
    good[bad_rows] = False
    findings: list[Finding] = []
    if again:
        what = f"left out: rows that repeat the header or its units ({len(again)}: line {lines_of(again, line_of)})"
        findings.append(Finding(name, what))
    if marks:
        what = f"left out: rows of text without a value ({len(marks)}: line {lines_of(marks, line_of)})"
        findings.append(Finding(name, what, _first_text(numbers.bad, marks[0])))
    if numbers.unfinished and time.size:
        findings.append(Finding(f"{name}:{line_of(time.size - 1)}", "the last line is incomplete and ignored"))
        good[-1] = False
    stop = int(np.flatnonzero(good)[-1]) + 1 if good.any() else time.size
    blank = _blank_rows(numbers, bad_rows)
    below = np.flatnonzero(~blank[stop:]) + stop
    below = below[: below.size - numbers.unfinished]
    summary = 0 < below.size <= _MOST_SUMMARY and numbers.complete
    if summary:
        what = f"left out: rows below the data ({below.size}: line {lines_of(below, line_of)})"
        findings.append(Finding(name, what, _first_text(bad, stop)))
    elif below.size:
        stop = time.size
    if numbers.multiline:
        what = "quoted line breaks: line numbers are approximate"
        findings.append(Finding(name, what, remedy="look for a stray quote if rows seem to be missing"))
    if numbers.grouped:
        findings.append(Finding(name, f"thousands separators removed from {numbers.grouped} numbers"))
    if numbers.infinite:
        findings.append(Finding(name, f"{numbers.infinite} infinite number(s) treated as missing values"))
    empty = np.setdiff1d(np.flatnonzero(blank[:stop]), [*again, *marks])
    if empty.size:
        what = f"left out: rows without any mapped value ({empty.size}: line {lines_of(empty, line_of)})"
        findings.append(Finding(name, what))
    problems = _problems([c for c in bad if c.row < stop], numbers, layout, position, name)
    kept = np.flatnonzero(~blank[:stop]) if empty.size or again or marks else None
    return DataRows(stop, kept, tuple(findings), problems)


def _clock(position: Mapping[str, int]) -> int:
    """The index of the clock; of a log without one, that of the first mapped column."""
    return position["time"] if "time" in position else next(iter(position.values()))


def _repeated_headers(bad: Sequence[BadCell], layout: Layout, time: Array, joined: bool) -> list[int]:
    """The rows that repeat the header or its units, as written by a logger that was stopped and continued.

    Rows after which the clock restarts count only in a file of several recordings: they begin another log.
    """
    rows: dict[int, list[BadCell]] = {}
    for cell in bad:
        rows.setdefault(cell.row, []).append(cell)
    units = layout.units or ("",) * len(layout.header)

    def goes_on(row: int) -> bool:
        before, behind = (part[np.isfinite(part)] for part in (time[:row], time[row:]))
        return bool(np.isnan(time[row]) and before.size and behind.size and (joined or behind[0] > before[-1]))

    def repeats(cells: Sequence[BadCell]) -> bool:
        return all(c.column >= 0 and _named(c.text, layout.header[c.column], units[c.column]) for c in cells)

    return [row for row, cells in rows.items() if repeats(cells) and goes_on(row)]


def _rows_of_text(numbers: Numbers, clock: int) -> list[int]:
    """The rows between samples with a text instead of a time and nothing else, such as the marks that a driver sets."""
    last = max(np.flatnonzero(np.isfinite(numbers.columns[clock])), default=-1)
    others = [values for i, values in numbers.columns.items() if i != clock]
    of_row = Counter(c.row for c in numbers.bad)
    texts = (c.row for c in numbers.bad if c.column == clock and of_row[c.row] == 1)
    return [row for row in texts if others and row < last and all(np.isnan(values[row]) for values in others)]


def _named(text: str, name: str, unit: str) -> bool:
    return tidy(text) == name or bool(unit and unit_text(text) == unit)


def has_decimal_commas(numbers: Numbers, delimiter: str) -> bool:
    """Whether some of the cells that are not numbers are numbers with a decimal comma, which is ambiguous in a file
    with commas between the cells where it may separate thousands."""
    commas = (c.text for c in numbers.bad if _EITHER_MARK.fullmatch(c.text) and "," in c.text)
    return any(not (delimiter == "," and may_be_thousands(text)) for text in commas)


def _blank_rows(numbers: Numbers, bad_rows: Rows) -> Mask:
    columns = iter(numbers.columns.values())
    blank = np.isnan(next(columns))
    for values in columns:
        if not blank.any():
            break
        blank &= np.isnan(values)
    blank[bad_rows] = False
    return blank


def _first_text(bad: tuple[BadCell, ...], stop: int) -> str:
    return next((repr(c.text[:40]) for c in bad if c.row >= stop), "")


def _problems(
    bad: list[BadCell], numbers: Numbers, layout: Layout, position: Mapping[str, int], name: str
) -> tuple[Finding, ...]:
    """Text among the numbers, one finding per column, and rows that are too long."""
    line_of = numbers.lines.of
    recordings = 1 + len(restarts(numbers.columns[_clock(position)])) if bad else 1
    problems = []
    for channel, column in position.items():
        cells = [c for c in bad if c.column == column]
        if not cells:
            continue
        header = layout.header[column]
        count = f"{'at least ' if len(bad) > MOST_BAD else ''}{len(cells)} cell{'s' if len(cells) > 1 else ''}"
        lines = lines_of([c.row for c in cells], line_of)
        what = f"text among the numbers of channel '{channel}', column '{header}': {count}, line {lines}"
        remedy = _remedy(channel, cells[0].text, header, layout, recordings)
        problems.append(Finding(f"{name}:{line_of(cells[0].row)}", what, repr(cells[0].text[:40]), remedy))
    long = [c for c in bad if c.column == -1]
    if long:
        lines = lines_of([c.row for c in long], line_of)
        what = f"rows longer than the header's {len(layout.header)} columns ({len(long)}: line {lines})"
        remedy = "quote cells that contain the delimiter; if numbers have decimal commas, export with ';'"
        problems.append(Finding(f"{name}:{line_of(long[0].row)}", what, repr(long[0].text[:40]), remedy))
    return tuple(problems)


def _remedy(channel: str, text: str, header: str, layout: Layout, recordings: int) -> str:
    if text == header:
        each = f"list the file as one run for each, with 'recording: 1' to 'recording: {recordings}', or split it"
        joined = "the header is repeated and the clock restarts: files were joined"
        return f"{joined}; {each if recordings > 1 else 'split them'}"
    if channel == "time" and _OF_DAY.search(text):
        return f"export the time as {FORMS}"
    if _EITHER_MARK.fullmatch(text):
        mark = "," if (layout.decimal or ".") == "." else "."
        if may_be_thousands(text) and not layout.decimal:
            remedy = "export whole numbers without thousands separators; if the comma is the decimal mark"
            return f"{remedy}, add 'reading: {{decimal: \",\"}}'"
        return f"if all numbers have this format, add 'reading: {{decimal: \"{mark}\"}}'"
    return "correct or remove these cells; an empty cell means no value"
