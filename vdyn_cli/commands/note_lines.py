"""The notes at the end of a command's text: place, fact and value on a line, the remedy below it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from vdyn_cli.quantities.result_schema import FindingEntry


def note_lines(findings: Sequence[FindingEntry]) -> Iterator[str]:
    """A heading and the findings, of the minor ones only the doubts; nothing where there is none."""
    shown = [f for f in findings if f.doubt or not f.minor]
    if shown:
        yield "\nNotes"
    for f in shown:
        yield f"  {f.where}: {f.what}" + (f" (got {f.got})" if f.got else "")
        if f.remedy:
            yield f"      -> {f.remedy}"
