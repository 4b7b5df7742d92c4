"""One step as a command: run it, say what came out, write JSON and report."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

from vdyn_cli.io.files import write_whole
from vdyn_cli.project.execute import Outcome, execute
from vdyn_cli.project.result_document import to_json
from vdyn_cli.quantities.errors import ResultError, alike
from vdyn_cli.report.words import estimate_text

Tell = Callable[..., None]


def run_step(
    name: str, path: Path, known_files: tuple[Path, ...], output: str, level: float | None, tell: Tell
) -> None:
    """Run a step and write ``DIR/name.json`` and ``DIR/name.html``, or the JSON on stdout for ``-``.

    Raises
    ------
    InputError, ResultError : nothing is written, but for the report that says why the answer is not good.
    """
    if output == "-":
        outcome = execute(name, path, known_files, level)
        sys.stdout.write(to_json(outcome.document))
    else:
        outcome = write_step(name, path, known_files, Path(output), level)
        tell(f"{Path(output) / name}.json and .html")
    result = outcome.result
    for finding in alike([f for f in result.findings if not f.doubt]):
        tell(f"note: {finding}", detail=finding.minor)
    for warning in result.fit.warnings:
        tell(f"warning: {warning}")
    for key, estimate in result.parameters.items():
        tell(f"  {key:<30} {estimate_text(estimate)}")
    tell(result.sentence)
    if result.diagnosis:
        tell(result.diagnosis.sentence)


def write_step(name: str, path: Path, known_files: tuple[Path, ...], folder: Path, level: float | None) -> Outcome:
    """Run a step and write its report and JSON; of an answer that is not good, only the report that says why."""
    from vdyn_cli.report.html import render, render_failure

    try:
        outcome = execute(name, path, known_files, level)
    except ResultError as error:
        write_whole(folder / f"{name}.html", render_failure(name, error.findings))
        raise
    text = to_json(outcome.document)
    page = render(outcome.result, outcome.document)
    write_whole(folder / f"{name}.html", page)
    write_whole(folder / f"{name}.json", text)
    return outcome
