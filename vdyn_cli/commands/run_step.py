"""One step as a command: run it, print its result, write JSON and report."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

from vdyn_cli.commands.section_file import discard_section, write_section
from vdyn_cli.io.files import write_whole
from vdyn_cli.project.execute import execute
from vdyn_cli.project.result_document import StepRecord, to_json
from vdyn_cli.quantities.errors import ResultError, merge_similar
from vdyn_cli.report.typography import estimate_text

Tell = Callable[..., None]


def run_step(
    name: str, path: Path, known_files: tuple[Path, ...], output: str, level: float | None, tell: Tell
) -> None:
    """Run a step, write ``DIR/name.json`` and ``DIR/name.html``, or the JSON on stdout for ``-``, and print the result.

    Parameters
    ----------
    output : the folder, or ``-``.
    level : probability of a false alarm of the diagnosis; None leaves it out.
    tell : prints a line; its argument ``detail`` marks lines for verbose output.

    Raises
    ------
    InputError : the input is wrong; nothing is written.
    ResultError : the result cannot be published; only the report is written, which says why.
    """
    if output == "-":
        record = execute(name, path, known_files, level)
        sys.stdout.write(to_json(record.document))
    else:
        record = write_step(name, path, known_files, Path(output), level)
        tell(f"{Path(output) / name}.json and .html")
    result = record.result
    for finding in merge_similar([f for f in result.findings if not f.doubt]):
        tell(f"note: {finding}", detail=finding.minor)
    for warning in result.fit.warnings:
        tell(f"warning: {warning}")
    for key, estimate in result.parameters.items():
        tell(f"  {key:<30} {estimate_text(estimate)}")
    tell(result.sentence)
    if result.diagnosis:
        tell(result.diagnosis.sentence)


def write_step(name: str, path: Path, known_files: tuple[Path, ...], folder: Path, level: float | None) -> StepRecord:
    """Run a step and write its report and JSON; for a result that cannot be published, only the report with the reason.

    Raises
    ------
    InputError, ResultError : as ``execute`` raises them.
    """
    from vdyn_cli.report.html import render, render_failure

    try:
        record = execute(name, path, known_files, level)
    except ResultError as error:
        discard_section(folder, name)
        write_whole(folder / f"{name}.html", render_failure(name, error.findings))
        raise
    text = to_json(record.document)
    rendered = render(record)
    write_whole(folder / f"{name}.html", rendered.page)
    write_whole(folder / f"{name}.json", text)
    write_section(folder, name, rendered.section)
    return record
