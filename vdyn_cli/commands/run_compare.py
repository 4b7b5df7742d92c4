"""``vdyn compare``: significant changes of parameters between two results, as a table for a terminal or as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from vdyn_cli.commands.console import text_columns
from vdyn_cli.project.parameter_comparison import compare_documents
from vdyn_cli.project.result_document import to_json
from vdyn_cli.quantities.number_text import number, two_digits
from vdyn_cli.quantities.parameter_json import read_document
from vdyn_cli.quantities.result_schema import ComparisonDocument


def run_compare(old: Path, new: Path, as_json: bool) -> tuple[str, int]:
    """The comparison as text, and the exit code: 0 no parameter changed, 1 at least one did.

    Parameters
    ----------
    old, new : parameter files. as_json : the comparison as JSON instead of text.

    Raises
    ------
    InputError : a file cannot be read or is not a parameter file, or the files have no parameter in common.
    """
    document = compare_documents(read_document(old), read_document(new), (str(old), str(new)))
    text = to_json(document.model_dump(mode="json")) if as_json else "\n".join(comparison_lines(document)) + "\n"
    return text, 1 if document.moved else 0


def comparison_lines(document: ComparisonDocument) -> Iterator[str]:
    """The lines of a comparison for a terminal, the conclusion first."""
    yield document.sentence
    yield ""
    header = ("parameter", "unit", "old", "new", "difference", "standard error", "z", "changed")
    rows = []
    for one in document.parameters:
        half = 2.0 * one.standard_error
        rows.append(
            (
                *(one.name, one.unit, _with_half(one.old, one.old_interval95), _with_half(one.new, one.new_interval95)),
                *(("+" if one.difference > 0 else "") + number(one.difference, half), two_digits(one.standard_error)),
                *(_signed(one.z), "yes" if one.moved else "no"),
            )
        )
    yield from text_columns(header, rows)
    for title, names in (
        ("Only in " + document.old, document.only_old),
        ("Only in " + document.new, document.only_new),
    ):
        if names:
            yield f"\n{title}\n  {', '.join(names)}"
    if document.verdicts:
        yield "\nVerdicts that changed"
        yield from (f"  {line}" for line in document.verdicts)
    yield f"\n{document.assumed}"


def _signed(z: float | None) -> str:
    """The statistic of a difference; a dash where it has no standard error."""
    return "-" if z is None else f"{z:+.1f}" if z else "0.0"


def _with_half(value: float, interval: tuple[float, float]) -> str:
    """A value and the half-width of its 95 % interval; the interval's ends if it is not symmetric."""
    low, high = value - interval[0], interval[1] - value
    half = 0.5 * (low + high)
    if not half > 0:
        return f"{value:.6g}"
    if max(low, high) > 1.1 * min(low, high):
        return f"{number(value, half)} [{number(interval[0], half)}, {number(interval[1], half)}]"
    return f"{number(value, half)} +- {two_digits(half)}"
