"""What commands write to the terminal: documents to stdout, lines to the user, tables and notes as text."""

from __future__ import annotations

import errno
import sys
from collections.abc import Callable, Iterator, Sequence

from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.result_schema import FindingEntry

Tell = Callable[..., None]  # writes a line to the user, with the keywords of ``print``


def write_out(text: str) -> None:
    """Write to stdout in UTF-8, whatever the terminal's encoding.

    Raises
    ------
    InputError : stdout is closed or full. BrokenPipeError : the reading process has ended.
    """
    try:
        if sys.stdout is None:
            raise OSError(errno.EBADF, "it is closed")
        sys.stdout.buffer.write(text.encode("utf-8"))
        sys.stdout.flush()
    except BrokenPipeError:
        raise
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise InputError(Finding("stdout", f"cannot be written: {why}", remedy="write into a folder with -o")) from None


def text_columns(header: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Lines of left-aligned columns, two spaces apart, without columns that have no text."""
    used = [i for i in range(len(header)) if any(row[i] for row in rows)]
    lines = [tuple(header[i] for i in used), *(tuple(row[i] for i in used) for row in rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(used))]
    for line in lines:
        yield "  " + "  ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)).rstrip()


def note_lines(findings: Sequence[FindingEntry]) -> Iterator[str]:
    """A heading and the findings, of the minor ones only the doubts; nothing where there is none."""
    shown = [f for f in findings if f.doubt or not f.minor]
    if shown:
        yield "\nNotes"
    for f in shown:
        yield f"  {f.where}: {f.what}" + (f" (got {f.got})" if f.got else "")
        if f.remedy:
            yield f"      -> {f.remedy}"
