"""Tables of texts for a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence


def text_columns(header: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Lines of left-aligned columns, two spaces apart, without columns that have no text."""
    used = [i for i in range(len(header)) if any(row[i] for row in rows)]
    lines = [tuple(header[i] for i in used), *(tuple(row[i] for i in used) for row in rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(used))]
    for line in lines:
        yield "  " + "  ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)).rstrip()
