"""``vdyn batch``: run the steps of many campaigns in parallel, with one table of all results."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

from vdyn_cli.commands.console import Tell, write_out
from vdyn_cli.commands.run_pipeline import attempt_step
from vdyn_cli.commands.step_processes import side_by_side
from vdyn_cli.io.files import write_whole
from vdyn_cli.io.folder_lock import pipeline_lock
from vdyn_cli.project.archive import ArchivedCampaign, archived_campaigns
from vdyn_cli.project.inputs import LoggedTest
from vdyn_cli.project.pipeline import StepOutcome, Task
from vdyn_cli.quantities.errors import Finding, InputError

COLUMNS = ("campaign", "step", "verdict", "parameter", "value", "low95", "high95", "unit", "problem")
BETWEEN = "::"  # separates campaign and step in the name of a task


def run_batch(archives: Sequence[Path], output: str, results: Path | None, jobs: int, tell: Tell) -> int:
    """Run every campaign, write the table, and return the exit code: 0 all steps have a result, 1 at least one has not.

    Parameters
    ----------
    archives : folders, pipelines or tests.
    output : the table's file, or ``-`` for stdout.
    results : folder for each campaign's JSON and reports, from which a later batch reuses unchanged results; None: they
        are not kept.
    jobs : number of steps to run in parallel.

    Raises
    ------
    InputError : an archive does not exist or contains no description, or the output cannot be written.
    """
    campaigns = archived_campaigns(archives)
    if output != "-" and Path(output).is_dir():
        raise InputError(Finding(output, "is a folder", remedy="name the file of the table with -o, such as table.csv"))
    for finding in (f for one in campaigns for f in one.problems):
        tell(str(finding))
    with TemporaryDirectory() as temporary, pipeline_lock(results or Path(temporary)):
        outcomes = _run(campaigns, results or Path(temporary), jobs, tell)
    text = StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    table.writerows(row for one in campaigns for row in _rows(one, outcomes))
    if output == "-":
        write_out(text.getvalue())
    else:
        write_whole(Path(output), text.getvalue().encode())
    failed = [c.name for c in campaigns if c.problems or not all(outcomes[_name(c, t)].good for t in c.tasks)]
    tell(f"{len(campaigns) - len(failed)} of {len(campaigns)} campaigns are complete" + _listed(failed))
    return 1 if failed else 0


def _listed(failed: Sequence[str]) -> str:
    return f"; not: {', '.join(failed)}" if failed else ""


def _name(campaign: ArchivedCampaign, task: Task) -> str:
    return f"{campaign.name}{BETWEEN}{task.name}"


def _run(campaigns: Sequence[ArchivedCampaign], folder: Path, jobs: int, tell: Tell) -> dict[str, StepOutcome]:
    tasks = []
    for one in campaigns:
        own = {t.name: _name(one, t) for t in one.tasks}
        tasks += [replace(t, name=own[t.name], after=tuple(own[n] for n in t.after)) for t in one.tasks]
    outcomes: dict[str, StepOutcome] = {}
    for outcome, seconds in side_by_side(tasks, jobs, partial(_attempt, folder=folder), {}):
        outcomes[outcome.name] = outcome
        campaign, _, step = outcome.name.rpartition(BETWEEN)
        place = f"[{len(outcomes)}/{len(tasks)}] {campaign} {step}"
        why = "".join(f": {f.where}: {f.what}" for f in outcome.problems[:1])
        tell(f"{place:<40} {outcome.status:<8} {seconds:5.1f} s  {outcome.sentence}{why}")
    return outcomes


def _attempt(
    task: Task, outcomes: Mapping[str, StepOutcome], test: LoggedTest | None, folder: Path
) -> Iterator[StepOutcome]:
    """Run one step of one campaign, with results in a folder of the campaign's name; yields as ``attempt_step``."""
    campaign, _, step = task.name.rpartition(BETWEEN)
    own = {n.rpartition(BETWEEN)[2]: o for n, o in outcomes.items() if n in task.after}
    local = replace(task, name=step, after=tuple(n.rpartition(BETWEEN)[2] for n in task.after))
    for outcome in attempt_step(local, own, test, folder / campaign, keep_going=True):
        yield replace(outcome, name=task.name, section="")


def _rows(campaign: ArchivedCampaign, outcomes: Mapping[str, StepOutcome]) -> Iterator[tuple[str, ...]]:
    """A row for each parameter, and one with the reason for each step or campaign without a result."""
    for finding in campaign.problems:
        yield (campaign.name, "", "failed", *[""] * 5, f"{finding.where}: {finding.what}")
    for task in campaign.tasks:
        outcome = outcomes[_name(campaign, task)]
        verdict = outcome.diagnosis.verdict if outcome.diagnosis else ""
        if outcome.record is None:
            why = "; ".join([outcome.reason, *(f"{f.where}: {f.what}" for f in outcome.problems)])
            yield (campaign.name, task.name, verdict or outcome.status, *[""] * 5, why)
            continue
        for name, e in outcome.record.result.parameters.items():
            low, high = e.interval95
            numbers = (f"{e.value:.8g}", f"{low:.8g}", f"{high:.8g}")
            yield (campaign.name, task.name, verdict, name, *numbers, e.unit, "")
