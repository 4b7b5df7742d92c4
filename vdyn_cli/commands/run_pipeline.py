"""``vdyn pipeline``: run the steps of a test day in order; a step is reused if none of its inputs has changed."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from vdyn_cli.commands.console import Tell
from vdyn_cli.commands.result_files import read_section, remove_leftovers, write_document
from vdyn_cli.commands.run_step import write_report
from vdyn_cli.commands.step_processes import side_by_side
from vdyn_cli.io.files import sha256, write_together
from vdyn_cli.io.folder_lock import pipeline_lock
from vdyn_cli.project.execute import RefusedResultError, execute
from vdyn_cli.project.inputs import LoggedTest
from vdyn_cli.project.pipeline import ParameterSet, StepOutcome, Task, load_plan, parameter_set
from vdyn_cli.project.result_document import StepRecord, read_record, step_command, to_json, versions
from vdyn_cli.quantities.errors import Finding, InputError, VdynError, merge_alike
from vdyn_cli.quantities.parameters import MissingParameterError

QUIET = ("adequate", "not_testable")  # verdicts that need no line on the console


def run_pipeline(path: Path, folder: Path, *, keep_going: bool, jobs: int, tell: Tell) -> int:
    """Run all steps, write ``parameters.json`` and ``report.html``, and return the exit code.

    Parameters
    ----------
    path, folder : the pipeline's description, and the folder for the results.
    keep_going : after a failure, run the steps that do not need the failed one.
    jobs : number of steps to run in parallel.
    tell : prints a line.

    Raises
    ------
    InputError : the pipeline's description is wrong, or another run writes into the folder; a failed step is reported,
        not raised.
    """
    from vdyn_cli.report.html import render_pipeline

    spec, source, tasks = load_plan(path)
    with pipeline_lock(folder):
        remove_leftovers(folder)
        outcomes = _run(tasks, folder, keep_going, jobs, _outcome_printer(tell, len(tasks)))
        found = parameter_set(spec, source, outcomes)
        # Written together, so that the page always shows the parameters of the JSON.
        page, document = render_pipeline(found), to_json(found.document)
        write_together({folder / "parameters.json": document, folder / "report.html": page})
    _say_summary(found, folder, tell)
    return max((o.exit_code for o in outcomes), default=0)


def _outcome_printer(tell: Tell, total: int) -> Callable[[StepOutcome, float], None]:
    seen: list[str] = []

    def print_outcome(outcome: StepOutcome, seconds: float) -> None:
        seen.append(outcome.name)
        tell(f"[{len(seen)}/{total}] {outcome.name:<10} {outcome.status:<8} {seconds:5.1f} s  {outcome.sentence}")
        if outcome.diagnosis and outcome.diagnosis.verdict not in QUIET:
            tell(f"    {outcome.diagnosis.sentence}")
        for finding in merge_alike(outcome.findings):
            tell("    " + str(finding).replace("\n", "\n    "))

    return print_outcome


PrintOutcome = Callable[[StepOutcome, float], None]


def _run(
    tasks: Sequence[Task], folder: Path, keep_going: bool, jobs: int, print_outcome: PrintOutcome
) -> tuple[StepOutcome, ...]:
    outcomes: dict[str, StepOutcome] = {}
    attempt = partial(attempt_step, folder=folder, keep_going=keep_going)
    if jobs > 1 and len(tasks) > 1:
        for outcome, seconds in _reused(tasks, folder):  # without processes, which would load much for nothing
            outcomes[outcome.name] = outcome
            print_outcome(outcome, seconds)
        for outcome, seconds in side_by_side(tasks, jobs, attempt, outcomes):
            outcomes[outcome.name] = outcome
            print_outcome(outcome, seconds)
        return tuple(outcomes[t.name] for t in tasks)
    for task in tasks:
        start = time.perf_counter()
        *_, outcomes[task.name] = attempt(task, outcomes, None)
        print_outcome(outcomes[task.name], time.perf_counter() - start)
    return tuple(outcomes.values())


def _reused(tasks: Sequence[Task], folder: Path) -> Iterator[tuple[StepOutcome, float]]:
    """The steps whose earlier result is reused, as far as they depend on such steps only, and their times, s."""
    done: set[str] = set()
    for task in tasks:
        start = time.perf_counter()
        if done.issuperset(task.after):
            earlier = _unchanged(task, folder, tuple(folder / f"{n}.json" for n in task.after))
            if earlier is not None:
                done.add(task.name)
                yield earlier, time.perf_counter() - start


def attempt_step(
    task: Task, outcomes: Mapping[str, StepOutcome], test: LoggedTest | None, folder: Path, keep_going: bool
) -> Iterator[StepOutcome]:
    """Run, reuse or skip one step, depending on the outcomes of the steps before it.

    Yields its outcome; before that, for a step that runs, the outcome without its section, as soon as steps that read
    the result can start. The page is drawn in between.

    Parameters
    ----------
    outcomes : of the steps that have ended, by name. test : its logs if they are read. folder : of the results.
    keep_going : after a failure, run the steps that do not need the failed one.
    """
    stopped = next((o for o in outcomes.values() if not o.good), None)
    if stopped is not None and not keep_going:
        yield StepOutcome(task.name, "skipped", reason=f"skipped because {stopped.name} failed")
        return
    known = tuple(folder / f"{n}.json" for n in task.after if outcomes[n].good)
    earlier = _unchanged(task, folder, known)
    try:
        yield from (earlier,) if earlier is not None else _run_step(task, known, folder, test)
    except MissingParameterError as error:
        failed = [n for n in task.after if not outcomes[n].good]
        if failed:
            reason = f"skipped because it needs parameters from {' and '.join(failed)}"
            yield StepOutcome(task.name, "skipped", reason=reason, problems=error.findings)
        else:
            yield _failure(task, error)
    except VdynError as error:
        yield _failure(task, error)
    except Exception as error:  # a bug in one step must not prevent the results of the others
        finding = Finding(task.name, f"vdyn has a bug: {type(error).__name__}: {error}")
        yield StepOutcome(task.name, "failed", reason="stopped by a bug in vdyn", problems=(finding,), exit_code=70)


def _run_step(task: Task, known: tuple[Path, ...], folder: Path, test: LoggedTest | None) -> Iterator[StepOutcome]:
    """The outcome of a step with its result written, then with its page."""
    try:
        record = execute(task.name, task.path, known, task.level, test)
    except RefusedResultError as error:
        write_report(error.record, task.name, folder)
        section = read_section(folder, task.name) or ""
        yield replace(_failure(task, error), section=section, refused=error.record)
        return
    write_document(folder, task.name, to_json(record.document))
    yield StepOutcome(task.name, "done", record)
    write_report(record, task.name, folder)
    # Read back, so that the page is the same for a step that ran now and one that is reused.
    record, section, digest = _written(folder, task.name)
    yield StepOutcome(task.name, "done", record, section, digest=digest)


def _failure(task: Task, error: VdynError) -> StepOutcome:
    reason = "the input is wrong" if isinstance(error, InputError) else "the result cannot be published"
    return StepOutcome(task.name, "failed", reason=reason, problems=error.findings, exit_code=error.exit_code)


def _written(folder: Path, name: str) -> tuple[StepRecord, str, str]:
    """Record, section and sha256 of the JSON in a step's folder; the section is empty if the files do not match."""
    section = read_section(folder, name) or ""
    record, digest = read_record(folder / f"{name}.json")
    return record, section, digest


def _unchanged(task: Task, folder: Path, known: tuple[Path, ...]) -> StepOutcome | None:
    """The earlier result if the same program version computed it from the same inputs, else None."""
    try:
        record, section, result = _written(folder, task.name)
        made = record.provenance
        by_name = {file.name: file for file in known}
        same = (
            record.result.step == task.name
            and made.command == step_command(task.name, task.path, known, task.level)
            and made.versions == versions()
            and all(sha256(by_name.get(n, task.path.parent / n)) == digest for n, digest in made.inputs.items())
        )
        return StepOutcome(task.name, "reused", record, section, digest=result) if same and section else None
    except Exception:  # no earlier result, an edited one, or one of another version: computed again
        return None


def _say_summary(found: ParameterSet, folder: Path, tell: Tell) -> None:
    outcomes = found.outcomes
    good, warned = sum(o.good for o in outcomes), sum(o.good and bool(o.findings) for o in outcomes)
    with_warnings = f", {warned} with warnings" if warned else ""
    known = f"{len(found.parameters)} parameters in {folder}/parameters.json"
    tell(f"{good} of {len(outcomes)} steps done{with_warnings}; {known}")
    if found.missing:
        tell(f"missing: {', '.join(found.missing)}")
    tell(f"report: {folder}/report.html")
