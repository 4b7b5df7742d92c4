"""Records to the bytes of a CSV file, in the dress of one bench or another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.plant.sensors import Record


@dataclass(frozen=True)
class Dress:
    """How a bench writes: delimiter, decimal mark, line end, byte-order mark, a row of units under the header."""

    delimiter: str = ","
    decimal: str = "."
    newline: str = "\n"
    encoding: str = "utf-8"  # "utf-8-sig" writes a byte-order mark


PLAIN = Dress()
WITH_BOM = Dress(encoding="utf-8-sig")
CONTINENTAL = Dress(delimiter=";", decimal=",")
WINDOWS = Dress(newline="\r\n")


def csv_bytes(record: Record, dress: Dress = PLAIN) -> bytes:
    """The file's bytes; each column with its own number of decimals (3 where the record is silent)."""
    columns = [
        np.char.mod(f"%.{record.decimals.get(name, 3)}f", values + 0.0) for name, values in record.columns.items()
    ]
    header = dress.delimiter.join(f'"{name}"' for name in record.columns)
    rows = [dress.delimiter.join(row).replace(".", dress.decimal) for row in zip(*columns, strict=True)]
    return (dress.newline.join([header, *rows]) + dress.newline).encode(dress.encoding)
