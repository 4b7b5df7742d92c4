"""The command of a step: run it, print its result, write JSON and report."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

from vdyn_cli.commands.console import Tell, write_out
from vdyn_cli.commands.result_files import section_lock, write_results
from vdyn_cli.io.folder_lock import refuse_busy
from vdyn_cli.project.execute import RefusedResultError, execute
from vdyn_cli.project.result_document import StepRecord, to_json
from vdyn_cli.quantities.diagnosis import WorstSegment
from vdyn_cli.quantities.errors import merge_similar
from vdyn_cli.quantities.number_text import two_digits
from vdyn_cli.report.parameter_table import spans_text
from vdyn_cli.report.typography import estimate_text

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class StepRun:
    """A step that has run.

    Parameters
    ----------
    record : its result. place : files of the result, as text. refused : the error of a result that is not published.
    replaced : the command whose result in these files was of another description; empty where there was none.
    """

    record: StepRecord
    place: str
    refused: RefusedResultError | None = None
    replaced: str = ""


def run_step(name: str, path: Path, known_files: tuple[Path, ...], output: str, level: float | None) -> StepRun:
    """Run a step and write ``DIR/name.json`` and ``DIR/name.html``, or, for ``-``, the JSON to stdout.

    Parameters
    ----------
    name : of the step. path, known_files : the description, and parameter files of other steps.
    output : the folder, or ``-``.
    level : false-alarm probability of the diagnosis; None: no diagnosis.

    Raises
    ------
    InputError : the input is wrong; nothing is written.
    """
    refused: RefusedResultError | None = None
    before: list[str] = []

    @contextmanager
    def lock(folder: Path) -> Iterator[None]:
        with section_lock(folder):  # a step that ran at the same time may have written meanwhile
            before.append(_earlier(folder / f"{name}.json", path))
            yield

    try:
        if output == "-":
            record = execute(name, path, known_files, level)
        else:
            refuse_busy(Path(output))
            record = write_step(name, path, known_files, Path(output), level, lock)
    except RefusedResultError as error:
        refused, record = error, error.record
    if output == "-":
        write_out(to_json(record.document))
    place = "" if output == "-" else f"{Path(output) / name}.json and .html"
    return StepRun(record, place, refused, "".join(before))


def _earlier(file: Path, description: Path) -> str:
    """The command of a result that this file has of another description; empty where it has none."""
    try:
        made = json.loads(file.read_text("utf-8"))["provenance"]
        return "" if description.name in made["inputs"] else str(made["command"])
    except (OSError, ValueError, KeyError, TypeError):  # no result
        return ""


def print_step(run: StepRun, tell: Tell) -> None:
    """Print the paths of a step's files, and its result.

    Parameters
    ----------
    tell : prints a line; its argument ``detail`` marks lines for verbose output, ``result`` those of the result.

    Raises
    ------
    RefusedResultError : the result is not published; report and JSON state the reason and contain no parameters.
    """
    if run.place:
        tell(run.place)
    if run.replaced:
        tell(f"note: {run.place}: replaced the result of '{run.replaced}'")
        tell("    -> keep both with -o and another folder")
    print_result(run.record, tell)
    if run.refused is not None:
        raise run.refused


def print_result(record: StepRecord, tell: Tell) -> None:
    """Print warnings, notes, parameters and the sentences of a record."""
    result = record.result
    for warning in result.fit.warnings:
        tell(f"warning: {warning}")
    for finding in merge_similar([f for f in result.findings if not f.doubt]):
        tell(f"note: {finding}", detail=finding.minor)
    if result.parameters:  # in a description, the number after +- is one standard deviation
        tell(f"  {'':<30} value ± half of the 95 % interval", result=True)
    for key, estimate in result.parameters.items():
        tell(f"  {key:<30} {estimate_text(estimate)}", result=True)
    wider = {
        e.spans: [k for k, o in result.parameters.items() if o.spans == e.spans] for e in result.parameters.values()
    }
    for spans, keys in wider.items():
        if spans:
            what = f"the interval is wider, since these data do not exclude {spans_text(spans)}"
            tell(f"  {', '.join(keys)}: {what}", result=True)
    for key, why in result.withheld.items():
        tell(f"  {key:<30} withheld: {why}", result=True)
    if not result.refused:  # else the error states the reasons
        tell(result.sentence, result=True)
    if result.diagnosis:
        tell(result.diagnosis.sentence, result=True)
        if result.diagnosis.verdict == "unknown" and result.diagnosis.where:
            tell(_largest_error(result.diagnosis.where[0]), result=True)
    if result.refused:
        tell("No result:")


def _largest_error(one: WorstSegment) -> str:
    size = f"{two_digits(one.size)} {one.unit} on average, {two_digits(abs(one.over_noise))} times the noise"
    return f"Largest error: {one.run}, {one.channel}, {one.segment}: {size}."


def write_step(
    name: str,
    path: Path,
    known_files: tuple[Path, ...],
    folder: Path,
    level: float | None,
    lock: Callable[[Path], AbstractContextManager[object]] = nullcontext,
) -> StepRecord:
    """Run a step and write its report and JSON; for a result that is not published, with the reason.

    Parameters
    ----------
    level : false-alarm probability of the diagnosis; None: no diagnosis.
    lock : (folder) -> context that locks it while the results are written.

    Raises
    ------
    InputError : from ``execute``. RefusedResultError : from ``execute``, after the files are written.
    """
    try:
        record = execute(name, path, known_files, level)
    except RefusedResultError as error:
        write_report(error.record, name, folder, lock)
        raise
    write_report(record, name, folder, lock)
    return record


def write_report(
    record: StepRecord,
    name: str,
    folder: Path,
    lock: Callable[[Path], AbstractContextManager[object]] = nullcontext,
) -> None:
    """Draw the page of a step's result, and write JSON, page and section together.

    Parameters
    ----------
    name : of the files, without suffix. folder : where they are written. lock : as for ``write_step``.

    Raises
    ------
    InputError : the folder cannot be written.
    """
    from vdyn_cli.report.html import render

    _LOG.info("writing the report")
    rendered = render(record)
    with lock(folder):
        write_results(folder, name, to_json(record.document), rendered.page, rendered.section)
