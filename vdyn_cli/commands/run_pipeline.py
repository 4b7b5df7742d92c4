"""A test day's steps run in order, each reusing what is unchanged; nothing that a Makefile could not do."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from pathlib import Path
from typing import Any

from vdyn_cli.commands.run_step import Tell, write_step
from vdyn_cli.io.files import sha256, write_whole
from vdyn_cli.project.pipeline import Status, StepOutcome, Task, load_plan, summary_document
from vdyn_cli.project.result_document import step_command, to_json, versions
from vdyn_cli.quantities.errors import Finding, InputError, VdynError, merge_similar
from vdyn_cli.quantities.parameters import MissingParameterError

QUIET = ("", "adequate", "not_testable")  # verdicts that a line on the console says nothing of


def run_pipeline(path: Path, folder: Path, *, keep_going: bool, jobs: int, tell: Tell) -> int:
    """Run all steps, write ``parameters.json`` and ``report.html``, and return the exit code.

    Raises
    ------
    InputError : the pipeline's own description is wrong; a step's failure is reported, not raised.
    """
    spec, source, tasks = load_plan(path)
    run = _run_side_by_side if jobs > 1 else _run_in_turn
    outcomes = run(tasks, folder, keep_going, jobs, _narrator(tell, len(tasks)))
    document = summary_document(spec, path, (path, *source.included), folder, outcomes)
    from vdyn_cli.report.html import render_pipeline

    write_whole(folder / "report.html", render_pipeline(spec.pipeline, outcomes, document, folder))
    write_whole(folder / "parameters.json", to_json(document))
    _say_summary(document, outcomes, folder, tell)
    return max((o.exit_code for o in outcomes), default=0)


def _narrator(tell: Tell, total: int) -> Callable[[StepOutcome, float], None]:
    seen: list[str] = []

    def narrate(outcome: StepOutcome, seconds: float) -> None:
        seen.append(outcome.name)
        tell(f"[{len(seen)}/{total}] {outcome.name:<10} {outcome.status:<8} {seconds:5.1f} s  {outcome.sentence}")
        if outcome.verdict not in QUIET:
            tell(f"    {outcome.diagnosis}")
        for finding in outcome.findings:
            tell("    " + str(finding).replace("\n", "\n    "))

    return narrate


Narrate = Callable[[StepOutcome, float], None]


def _run_in_turn(
    tasks: Sequence[Task], folder: Path, keep_going: bool, jobs: int, narrate: Narrate
) -> tuple[StepOutcome, ...]:
    outcomes: dict[str, StepOutcome] = {}
    for task in tasks:
        start = time.perf_counter()
        outcome = _attempt(task, folder, outcomes, keep_going)
        outcomes[task.name] = outcome
        narrate(outcome, time.perf_counter() - start)
    return tuple(outcomes.values())


def _run_side_by_side(
    tasks: Sequence[Task], folder: Path, keep_going: bool, jobs: int, narrate: Narrate
) -> tuple[StepOutcome, ...]:
    outcomes: dict[str, StepOutcome] = {}
    waiting = list(tasks)
    running: dict[Future[StepOutcome], float] = {}
    with ProcessPoolExecutor(jobs) as pool:
        while waiting or running:
            for task in [t for t in waiting if all(n in outcomes for n in t.after)]:
                waiting.remove(task)
                future = pool.submit(_attempt, task, folder, dict(outcomes), keep_going)
                running[future] = time.perf_counter()
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                outcome = future.result()
                outcomes[outcome.name] = outcome
                narrate(outcome, time.perf_counter() - running.pop(future))
    return tuple(outcomes[t.name] for t in tasks)


def _attempt(task: Task, folder: Path, outcomes: Mapping[str, StepOutcome], keep_going: bool) -> StepOutcome:
    """Run, reuse or skip one step, given how the steps before it ended."""
    stopped = next((o for o in outcomes.values() if not o.good), None)
    if stopped is not None and not keep_going:
        return StepOutcome(task.name, "skipped", f"{stopped.name} failed before")
    known = tuple(folder / f"{n}.json" for n in task.after if outcomes[n].good)
    earlier = _unchanged(task, folder, known)
    if earlier is not None:
        return _ended(task, "reused", earlier)
    try:
        return _ended(task, "done", write_step(task.name, task.path, known, folder, task.level).document)
    except MissingParameterError as error:
        failed = [n for n in task.after if not outcomes[n].good]
        if failed:
            needs = f"needs what {' and '.join(failed)} did not give"
            return StepOutcome(task.name, "skipped", needs, error.findings)
        return _failure(task, error)
    except VdynError as error:
        return _failure(task, error)
    except Exception as error:  # a bug in one step must not cost the day's other results
        finding = Finding(task.name, f"vdyn has a bug: {type(error).__name__}: {error}")
        return StepOutcome(task.name, "failed", "stopped by a bug", (finding,), 70)


def _ended(task: Task, status: Status, document: Mapping[str, Any]) -> StepOutcome:
    told = document.get("diagnosis") or {}
    verdict, text = str(told.get("verdict", "")), str(told.get("sentence", ""))
    findings = _to_read(document)
    return StepOutcome(task.name, status, str(document["sentence"]), findings, verdict=verdict, diagnosis=text)


def _failure(task: Task, error: VdynError) -> StepOutcome:
    what = "the input is wrong" if isinstance(error, InputError) else "the answer is not good"
    return StepOutcome(task.name, "failed", what, error.findings, error.exit_code)


def _to_read(document: Mapping[str, Any]) -> tuple[Finding, ...]:
    """What a good result still warns of."""
    warnings = [Finding(document["step"], text) for text in document["fit"]["warnings"]]
    findings = [Finding(**f) for f in document["findings"]]
    return (*warnings, *(f for f in merge_similar(findings) if not (f.minor or f.doubt)))


def _unchanged(task: Task, folder: Path, known: tuple[Path, ...]) -> Mapping[str, Any] | None:
    """The earlier result's document where it was made from the same bytes by the same program, else None."""
    try:
        document = json.loads((folder / f"{task.name}.json").read_text(encoding="utf-8"))
        made = document["provenance"]
        fingerprints: Mapping[str, str] = made["inputs"]
        by_name = {file.name: file for file in known}
        same = (
            made["command"] == step_command(task.name, task.path, known, task.level)
            and made["versions"] == versions()
            and all(sha256(by_name.get(n, task.path.parent / n)) == digest for n, digest in fingerprints.items())
            and (folder / f"{task.name}.html").is_file()
        )
        return document if same and document["sentence"] and _to_read(document) is not None else None
    except (OSError, ValueError, KeyError, TypeError, InputError):
        return None  # no earlier result that can be trusted


def _say_summary(document: Mapping[str, Any], outcomes: Sequence[StepOutcome], folder: Path, tell: Tell) -> None:
    good, read = sum(o.good for o in outcomes), sum(o.good and bool(o.findings) for o in outcomes)
    of_these = f", {read} of them to be read first" if read else ""
    known = f"{len(document['parameters'])} parameters in {folder}/parameters.json"
    tell(f"{good} of {len(outcomes)} steps good{of_these}; {known}")
    if document["missing"]:
        tell(f"missing: {', '.join(document['missing'])}")
    tell(f"report: {folder}/report.html")
