"""Reading a CSV log as test benches write it: only the mapped columns, in SI, with everything doubtful said."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.csv.csv_columns import Column, match_columns
from vdyn_cli.io.csv.csv_layout import Layout, ReadOptions, find_layout
from vdyn_cli.io.csv.csv_numbers import Lines, Numbers, read_numbers
from vdyn_cli.io.csv.csv_rows import data_rows, has_decimal_commas
from vdyn_cli.io.csv.csv_source import open_source
from vdyn_cli.io.quality.channel_quality import check_channel
from vdyn_cli.io.sample_times import LineOf, check_rising, check_steps
from vdyn_cli.quantities.errors import Finding, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import to_si
from vdyn_cli.quantities.vocabulary import TREMBLING

__all__ = ["Column", "ReadOptions", "read_csv"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


def read_csv(
    path: Path, columns: Mapping[str, Column], options: ReadOptions | None = None, name: str | None = None
) -> Log:
    """Read the mapped columns of a log.

    Parameters
    ----------
    path : comma, semicolon, tab, bar or blank separated text, plain or gzip, in any common encoding.
    columns : where each channel stands; ``time`` among them.
    options : how the file is written, where guessing is not wanted.
    name : what it is called in the log and in all findings; else as the file: each day may have its ``run_1.csv``.

    Returns
    -------
    Log : SI, on the clock as written. Rows without any value and a summary below the data are left out; a missing
        value is NaN. Nothing is interpolated or sorted. Its findings say all that is doubtful.

    Raises
    ------
    InputError : with every problem of the file: no such file or column, text among the numbers, a clock that does
        not rise, a channel without data.

    Notes
    -----
    A decimal comma is recognised. Thousands separators are removed where a number holds both marks, ``1.234,5`` or
    ``1,234.5``, and that is said. Headers and units rows are compared with the units of the description.
    """
    options, name = options or ReadOptions(), name or path.name
    layout, numbers, position, findings = _read(path, columns, options, name)
    rows = data_rows(numbers, layout, position, name)
    findings += rows.findings
    raise_all(rows.problems)
    place = {channel: f"{name}, column '{layout.header[at]}'" for channel, at in position.items()}
    raw = {channel: numbers.columns[at][: rows.stop] for channel, at in position.items()}
    raw["time"] = _si(raw["time"], columns["time"])
    raw, line_of, problems = _rising(raw, rows.kept, numbers.lines, options, place["time"], findings)
    numbers.columns.clear()
    channels = {}
    for channel in [c for c in raw if c != "time"]:
        values = raw.pop(channel)
        quality = check_channel(values, columns[channel].unit, place[channel], line_of, channel in TREMBLING)
        findings += quality.findings
        if quality.problems and columns[channel].optional:
            findings += [replace(p, remedy=f"channel '{channel}' is left out") for p in quality.problems]
        elif quality.problems:
            problems += quality.problems
        else:
            channels[channel] = _si(values, columns[channel])
    raise_all(problems)
    return Log(name, raw["time"], channels, tuple(findings))


def _read(
    path: Path, columns: Mapping[str, Column], options: ReadOptions, name: str
) -> tuple[Layout, Numbers, Mapping[str, int], list[Finding]]:
    """The file's layout, the mapped numbers, each channel's position, and what is doubtful so far."""
    wanted = [columns["time"].column, *(c.column for k, c in columns.items() if k != "time")]
    with open_source(path, options.encoding) as source:
        first = next(source.blocks, b"")
        layout = find_layout(first, source.encoding, wanted, options, name)
        match = match_columns(layout, columns, name)
        raise_all(match.problems)
        positions = list(match.position.values())
        numbers = read_numbers(chain([first], source.blocks), layout, positions, source.encoding, name)
    if not layout.decimal and has_decimal_commas(numbers):
        return _read(path, columns, replace(options, decimal=","), name)
    return layout, numbers, match.position, [*layout.findings, *match.findings]


def _rising(
    raw: dict[str, Array],
    kept: Rows | None,
    lines: Lines,
    options: ReadOptions,
    where: str,
    findings: list[Finding],
) -> tuple[dict[str, Array], LineOf, list[Finding]]:
    """The rows that are data and whose time rises; the file's line of each; the problems of the clock."""
    if kept is not None:
        raw = {channel: values[kept] for channel, values in raw.items()}
    rising = check_rising(raw["time"], options.clock, where, partial(_line, lines, kept))
    findings += rising.findings
    if rising.kept is not None:
        rows = np.flatnonzero(rising.kept)
        raw = {channel: values[rows] for channel, values in raw.items()}
        kept = rows if kept is None else kept[rows]
    line_of = partial(_line, lines, kept)
    problems = list(rising.problems)
    findings += [] if problems else check_steps(raw["time"], where, line_of)
    if raw["time"].size < 2:
        problems.append(Finding(where, "fewer than two rows of data", remedy="export the log again, with its data"))
    return raw, line_of, problems


def _line(lines: Lines, kept: Rows | None, row: int) -> int:
    return lines.of(int(row if kept is None else kept[row]))


def _si(values: Array, column: Column) -> Array:
    """Values in SI with the sign of our convention."""
    converted = to_si(values, column.unit, column.si_unit)
    return -converted if column.sign < 0 else converted
