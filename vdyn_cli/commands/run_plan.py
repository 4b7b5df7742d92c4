"""``vdyn plan``: expected accuracy of planned runs, as text for a terminal or as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from vdyn_cli.commands.console import note_lines, text_columns, write_out
from vdyn_cli.io.files import write_together
from vdyn_cli.project.planned.day_plan import plan
from vdyn_cli.project.result_document import to_json
from vdyn_cli.quantities.number_text import number, two_digits
from vdyn_cli.quantities.plan_schema import PlanDocument, PlannedParameter
from vdyn_cli.report.typography import count

SHOWN = 8  # pairs listed in the text; the JSON has all


def run_plan(path: Path, known_files: tuple[Path, ...], runs: int | None, output: str) -> int:
    """Print the plan, and return the exit code: 0 the runs determine every parameter, 1 they do not.

    Parameters
    ----------
    runs : number of runs; None: those of the description.
    output : ``-``: JSON to stdout instead of the text; a path: JSON to that file in addition; empty: text only.

    Raises
    ------
    InputError : the description is wrong, or the step cannot be planned without a log.
    """
    document = plan(path, known_files, runs)
    as_json = to_json(document.model_dump(mode="json")) if output else ""
    if output not in ("", "-"):
        write_together({Path(output): as_json})
    write_out(as_json if output == "-" else "\n".join(plan_lines(document)) + "\n")
    return 0 if document.good else 1


def plan_lines(document: PlanDocument) -> Iterator[str]:
    """The text for a terminal, the conclusion first."""
    yield document.sentence
    channels = ", ".join(document.channels)
    if any(p.value is not None for p in document.parameters):
        yield from _accuracy_lines(document, channels)
    else:
        yield f"\nChannels: {channels}"
    yield from _effect_lines(document)
    yield from _added_lines(document)
    yield from _assumed_lines(document)
    yield from note_lines(document.findings)


def _accuracy_lines(document: PlanDocument, channels: str) -> Iterator[str]:
    yield f"\nExpected accuracy of {count(document.runs, 'run')} with the channels {channels}"
    header = ("parameter", "value", "standard error", "95 % interval", "", "unit", "")
    yield from text_columns(header, [_row(p) for p in document.parameters])


def _effect_lines(document: PlanDocument) -> Iterator[str]:
    if document.detectable:
        yield "\nCandidate effects that these runs can detect, with the smallest detectable amplitude"
        yield from text_columns(
            ("effect", "amplitude", "unit"),
            [(d.effect, two_digits(d.amplitude), d.unit or "1") for d in document.detectable],
        )
    if document.not_testable:
        yield "\nCandidate effects that these runs cannot detect"
        yield from text_columns(("effect", "reason"), [(n.effect, n.because) for n in document.not_testable])
    if document.confused:
        yield "\nPairs that these runs cannot separate (t: standard errors, at half of the plausible range)"
        rows = [(f"{p.effects[0]} and {p.effects[1]}", f"{p.t:.1f}") for p in document.confused[:SHOWN]]
        yield from text_columns(("pair", "t"), rows)
        if len(document.confused) > SHOWN:
            yield f"  and {len(document.confused) - SHOWN} more, in the JSON"


def _assumed_lines(document: PlanDocument) -> Iterator[str]:
    if document.assumed:
        yield "\nThe plan assumes (change with 'plan: {key: value}' in the description)"
        rows = [
            (a.name, f"{a.value:.4g}", a.unit or "1", "stated" if a.stated else "default", a.meaning)
            for a in document.assumed
        ]
        yield from text_columns(("key", "value", "unit", "", ""), rows)


def _row(p: PlannedParameter) -> tuple[str, ...]:
    if p.value is None or p.std is None or p.half95 is None:
        return p.name, "", "", "", "not determined", p.unit or "1", p.why
    share = f"{two_digits(100 * p.half95 / abs(p.value))} %" if p.value else ""
    value = number(p.value, p.half95)
    return p.name, value, two_digits(p.std), f"+- {two_digits(p.half95)}", share, p.unit or "1", p.why


def _added_lines(document: PlanDocument) -> Iterator[str]:
    if not document.added:
        return
    yield "\nRuns to add, the least effort first (t: standard errors, at half of the plausible range)"
    for one in document.added:
        yield f"  {one.manoeuvre}"
        if one.std:
            yield f"    standard error then: {', '.join(f'{n} {two_digits(s)}' for n, s in one.std.items())}"
        if one.separates:
            each = [f"{' against '.join(s.effects)} (t = {s.t:.1f})" for s in one.separates[:SHOWN]]
            more = f" and {len(one.separates) - SHOWN} more" if len(one.separates) > SHOWN else ""
            yield f"    detects: {', '.join(each)}{more}"
