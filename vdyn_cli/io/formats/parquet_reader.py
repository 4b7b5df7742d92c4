"""Parquet tables, read with pyarrow: one row per sample; only the mapped columns are read.

Nulls become NaN; timestamps become seconds since the first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from vdyn_cli.io.formats.stored_channels import StoredChannel, damage_reported, missing_library, refuse_missing
from vdyn_cli.io.formats.stored_reader import StoredReader
from vdyn_cli.quantities.arrays import Array

_UNIT_KEYS = (b"unit", b"units", b"Unit", b"Units")
_PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


class _ParquetTable:
    """An open Parquet file."""

    row = "row"

    def __init__(self, file: Any, path: Path) -> None:
        self._file, self._path = file, path
        self.listed = tuple(_listed(file.schema_arrow))

    def line(self, channel: StoredChannel, row: int) -> int:
        """The number of a row, counted from 1."""
        return row + 1

    def columns(self, wanted: Sequence[StoredChannel]) -> Sequence[Array | None]:
        """The columns, read one at a time, so that memory holds only one of them twice."""
        return [self._column(channel) for channel in wanted]

    def _column(self, channel: StoredChannel) -> Array | None:
        from pyarrow import ArrowException, default_memory_pool

        with damage_reported(self._path, "pyarrow", ArrowException, OSError):
            same = [c for c in self.listed if c.name == channel.name]
            column = self._file.read(columns=[channel.name], use_threads=False).column(same.index(channel))
            found = _numbers(column)
            del column
            default_memory_pool().release_unused()  # otherwise the buffers of every column stay allocated
            return found


def _listed(schema: Any) -> Iterator[StoredChannel]:
    for index, field in enumerate(schema):
        metadata = field.metadata or {}
        unit = next((metadata[k].decode("utf-8", "replace") for k in _UNIT_KEYS if k in metadata), "")
        kind = str(field.type)
        if kind.startswith(("timestamp", "duration", "time32", "time64")):
            unit = "s"
        yield StoredChannel(field.name, unit, "table", index)


def _numbers(column: Any) -> Array | None:
    """A column as numbers, NaN for null; None if it contains text or nested values."""
    import pyarrow as pa

    kind = column.type
    if pa.types.is_dictionary(kind):
        column, kind = column.cast(kind.value_type), kind.value_type
    if pa.types.is_null(kind):
        return np.full(len(column), np.nan)
    if pa.types.is_boolean(kind):
        column = column.cast(pa.int8())
    elif pa.types.is_timestamp(kind) or pa.types.is_duration(kind) or pa.types.is_time(kind):
        import pyarrow.compute as pc

        whole = column.cast(pa.int32()).cast(pa.int64()) if pa.types.is_time32(kind) else column.cast(pa.int64())
        first = next((x for x in whole.drop_null()[:1].to_pylist()), 0) if pa.types.is_timestamp(kind) else 0
        column = pc.divide(pc.subtract(whole, first).cast(pa.float64(), safe=False), _PER_SECOND[kind.unit])
    elif not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)):
        return None
    return np.array(column.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)


@contextmanager
def _opened(path: Path) -> Iterator[_ParquetTable]:
    refuse_missing(path)
    try:
        from pyarrow import ArrowException
        from pyarrow.parquet import ParquetFile
    except ImportError:
        missing_library(path, "pyarrow", "parquet", "a Parquet file")
    with damage_reported(path, "pyarrow", ArrowException, OSError):
        file = ParquetFile(path, pre_buffer=False)
        table = _ParquetTable(file, path)
    try:
        yield table
    finally:
        file.close()


READER = StoredReader(lambda head, path: head.startswith(b"PAR1"), _opened)
