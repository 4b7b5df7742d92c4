"""JSON logs: an object for each sample, one per line or in an array, or an array for each channel.

Objects of equal keys are a table with its own clock; objects with time, name and value are a long table, as OpenXC
writes it. Keys of nested objects are joined by dots. Arrays of one length in an object are the columns of a table; so
are objects of one length (pandas), the ``data`` of streams (Strava), and rows beside an array ``columns``.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from vdyn_cli.io.clocks.written_times import is_instant, written_seconds
from vdyn_cli.io.csv.csv_cells import number_of
from vdyn_cli.io.formats.long_table_reader import LongTable, long_head
from vdyn_cli.io.formats.stored_channels import StoredChannel, StoredFile, refuse_missing
from vdyn_cli.io.formats.stored_reader import StoredReader
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, InputError

_BEGINS = re.compile(rb"\s*(\[\s*)?\{\s*\"")
_FEWEST = 10  # objects of equal keys that are a table; fewer are a head, or laps
_DEEPEST = 6  # nested objects

Record = Mapping[str, Any]


class _JsonTables:
    """The tables of a file, one for each set of keys."""

    row = "line"

    def __init__(self, records: Sequence[tuple[int, Record]]) -> None:
        self._tables: list[list[tuple[int, Record]]] = []
        kinds: dict[frozenset[str], list[tuple[int, Record]]] = {}
        for line, record in records:
            kinds.setdefault(frozenset(record), []).append((line, record))
        self._tables = [rows for rows in kinds.values() if len(rows) >= _FEWEST]
        listed: list[StoredChannel] = []
        for table, rows in enumerate(self._tables):
            group = f"table {table + 1}" if len(self._tables) > 1 else ""
            for key in rows[0][1]:
                unit = "s" if self._is_written_time(table, key) else ""
                listed.append(StoredChannel(key, unit, table, (table, key), group))
        self.listed = tuple(listed)
        instants = [self._samples(c.at[0], c.at[1])[:1] for c in self.listed if isinstance(c.at, tuple) and c.unit]
        self._first = float(np.min(np.concatenate(instants))) if instants else 0.0

    def line(self, channel: StoredChannel, row: int) -> int:
        """The line of a row, or the number of its object in an array."""
        return self._tables[int(str(channel.table))][row][0]

    def columns(self, wanted: Sequence[StoredChannel]) -> Sequence[Array | None]:
        """The samples (n,) of channels of one table; None for text."""
        found: list[Array | None] = []
        for channel in wanted:
            table, key = channel.at if isinstance(channel.at, tuple) else (0, "")
            values = self._samples(table, key) - (self._first if channel.unit else 0.0)
            found.append(values if np.isfinite(values).any() else None)
        return found

    def _is_written_time(self, table: int, key: str) -> bool:
        return is_instant(str(self._tables[table][0][1][key]))

    def _samples(self, table: int, key: str) -> Array:
        cells = [record[key] for _, record in self._tables[table]]
        if self._is_written_time(table, key):
            return written_seconds(np.array(cells, dtype=object))
        return np.array([_number(cell) for cell in cells], dtype=np.float64)


def _number(cell: object) -> float:
    if isinstance(cell, (bool, int, float)):
        return float(cell)
    value = number_of(cell, "")[0] if isinstance(cell, str) else None
    return np.nan if value is None else value


def _flat(record: Mapping[str, Any], path: str = "", depth: int = 0) -> Iterator[tuple[str, Any]]:
    for key, value in record.items():
        if isinstance(value, Mapping) and depth < _DEEPEST:
            yield from _flat(value, f"{path}{key}.", depth + 1)
        elif not isinstance(value, (list, Mapping)):
            yield path + key, value


def _objects(text: str) -> list[tuple[int, Record]]:
    """The objects of an array, of the longest array in an object, or of the lines, with their numbers."""
    try:
        whole = json.loads(text)
    except ValueError:
        found = []
        for number, line in enumerate(text.splitlines(), 1):
            try:
                found.append((number, json.loads(line)))
            except ValueError:
                continue  # the last line of a log that was cut off
    else:
        values = whole.values() if isinstance(whole, dict) else [whole]
        arrays: list[list[Any]] = [value for value in values if isinstance(value, list)]
        longest: list[Any] = max(arrays, key=len) if arrays else []
        found = list(enumerate(longest, 1))
        if isinstance(whole, dict) and not any(isinstance(one, dict) for one in longest):
            columns = _columns(whole)
            rows = zip(*columns.values(), strict=True)
            found = [(n, dict(zip(columns, row, strict=True))) for n, row in enumerate(rows, 1)]
    return [(number, dict(_flat(one))) for number, one in found if isinstance(one, dict)]


def _columns(whole: Mapping[str, Any], depth: int = 0) -> dict[str, list[Any]]:
    """The longest arrays of one length in an object or in one of its objects, as columns by name; empty if none."""
    names, rows = whole.get("columns"), whole.get("data")
    if isinstance(names, list) and isinstance(rows, list) and all(isinstance(r, list) for r in rows):
        return {str(name): [r[k] for r in rows if len(r) == len(names)] for k, name in enumerate(names)}
    arrays: dict[str, list[Any]] = {}
    for key, value in whole.items():
        one = value.get("data", [*value.values()]) if isinstance(value, dict) else value
        if isinstance(one, list) and one and all(isinstance(v, list) and len(v) == 2 for v in one) and "lat" in key:
            arrays |= {"lat": [v[0] for v in one], "lng": [v[1] for v in one]}
        elif isinstance(one, list) and not any(isinstance(v, (list, dict)) for v in one):
            arrays[key] = one
    length = max(map(len, arrays.values()), default=0)
    found = {key: one for key, one in arrays.items() if len(one) == length}
    if length >= _FEWEST and len(found) > 1:
        return found
    inner = (_columns(v, depth + 1) for v in whole.values() if isinstance(v, dict) and depth < _DEEPEST)
    return next((columns for columns in inner if columns), {})


def _parsed(path: Path) -> StoredFile:
    refuse_missing(path)
    records = _objects(path.read_bytes().decode("utf-8-sig", "replace"))
    usual = next((one for _, one in records if (head := long_head(tuple(one))) is not None), None)
    if usual is not None and (head := long_head(tuple(usual))) is not None:
        rows = [(n, [str(one.get(name, "")) for name in head.names]) for n, one in records]
        kept = [(n, row) for n, row in rows if row[head.name]]
        return LongTable(head, [row for _, row in kept], [n for n, _ in kept])
    tables = _JsonTables(records)
    if not tables.listed:
        what = (
            f"is JSON without a series of at least {_FEWEST} objects of equal keys, or arrays of one length: not a log"
        )
        raise InputError(Finding(path.name, what, remedy="convert it to CSV, with a column for each channel"))
    return tables


READER = StoredReader(lambda head, path: _BEGINS.match(head) is not None, lambda path: nullcontext(_parsed(path)))
