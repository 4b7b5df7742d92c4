"""Transposition of split-time tables with one row per run: each run becomes a column, each speed level a row.

Run;120;100;80          Run;1;2
1;0;7.4;16.8       ->   120;0;0
2;0;7.3;16.6            100;7.4;7.3
                        80;16.8;16.6
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence

from vdyn_cli.io.csv.csv_source import CsvSource
from vdyn_cli.io.csv.vbox_coastdown_table import Levels, read_report, transposed_report
from vdyn_cli.quantities.errors import Finding, InputError

_DELIMITERS = ";\t|,"
_LEVEL = re.compile(
    r"\s*v?\s*(\d+(?:[.,]\d+)?)\s*(km/h|kph|mph|m/s)?\s*", re.IGNORECASE
)  # a speed as the header of a column
_FEWEST_LEVELS = 2  # levels


def runs_as_columns(source: CsvSource, first: bytes, name: str, levels: Levels) -> CsvSource:
    """The transposed table, with a column for each row of the file; columns without a speed as header are left out.

    Parameters
    ----------
    source : of the file. first : its first block.
    name : of the file, for messages.
    levels : m/s, for a coast-down report, which does not state them.

    Raises
    ------
    InputError : no row has two speed levels after its first cell, or the levels of a report are not given.
    """
    lines = (first + b"".join(source.blocks)).decode(source.encoding, "replace").splitlines()
    if report := read_report(lines):
        return _as_source(transposed_report(report, levels, name))
    for delimiter in _DELIMITERS:
        rows = [row for row in csv.reader(lines, delimiter=delimiter) if any(cell.strip() for cell in row)]
        for at, head in enumerate(rows):
            heads = {i: m[1] for i, cell in enumerate(head) if i and (m := _LEVEL.fullmatch(cell))}
            runs = [row for row in rows[at + 1 :] if len(row) == len(head)]
            if len(heads) < _FEWEST_LEVELS or not runs or _LEVEL.fullmatch(head[0]):
                continue
            table = [[head[0].strip(), *(row[0].strip() for row in runs)]]
            table += [[level, *(row[i].strip() for row in runs)] for i, level in heads.items()]
            return _as_source(table)
    what = "is not a table with a row for each run: no row has speed levels after its first cell"
    raise InputError(Finding(name, what, remedy="remove 'split_runs: rows', or write the levels in one row"))


def _as_source(table: Sequence[Sequence[str]]) -> CsvSource:
    text = "\n".join("\t".join(row) for row in table) + "\n"
    return CsvSource("utf-8", iter([text.encode()]))
