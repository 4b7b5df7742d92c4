"""Parallel execution of steps, each in its own process, so that a crash affects only one step."""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import cast

from vdyn_cli.effects import catalog
from vdyn_cli.project.checks.check import step_of
from vdyn_cli.project.inputs import LoggedTest, logged_test
from vdyn_cli.project.pipeline import StepOutcome, Task
from vdyn_cli.project.result_document import versions
from vdyn_cli.quantities.errors import Finding, VdynError
from vdyn_cli.report import canvas, template

WATCH = 0.3  # s, interval at which a process checks that the pipeline still runs
PAGE_NICENESS = 10  # by which the priority of a process is lower while it draws its page
# Loaded before the processes are forked, beside matplotlib and the effects; each would otherwise load them in 1 s.
SHARED = (
    "scipy.optimize",
    "jinja2",
    "llvmlite.binding",
    "vdyn_cli.engine.native",
    "vdyn_cli.report.step_page",
)
Attempt = Callable[[Task, Mapping[str, StepOutcome], LoggedTest | None], Iterator[StepOutcome]]


@dataclass
class _Running:
    """A step's process, from its start, s, to its end.

    ``waiting``: it does not have the results that it reads yet. ``busy``: it computes or reads logs; not while it waits
    with read logs, nor while it draws the page of a result that others can read.
    """

    task: Task
    process: BaseProcess
    begun: float
    waiting: bool
    busy: bool = True


def side_by_side(
    tasks: Sequence[Task], jobs: int, attempt: Attempt, known: Mapping[str, StepOutcome]
) -> Iterator[tuple[StepOutcome, float]]:
    """Yield the outcome of each step that is not ``known``, and its time, s, when it ends.

    A process without work to do reads the logs of a step whose earlier steps still run. No process outlives the caller.

    Parameters
    ----------
    tasks : all steps. known : outcomes of those that need not run.
    jobs : number of steps to run in parallel; as many more may wait with their logs read, or draw their page.
    attempt : (task, outcomes of other steps, its logs if they were read before) -> its outcomes: with the first, steps
        that read its result can start; the last is the outcome. Must be picklable.

    Raises
    ------
    ValueError : steps come after each other in a circle, or after one that is neither a task nor known.
    """
    outcomes = dict(known)
    unstarted = [task for task in tasks if task.name not in outcomes]
    running: dict[Connection, _Running] = {}
    if unstarted and multiprocessing.get_start_method() == "fork":
        _load_shared()
    try:
        while unstarted or running:
            _start_steps(unstarted, running, jobs, attempt, outcomes)
            if not running:
                raise ValueError(f"steps wait for others that never end: {', '.join(t.name for t in unstarted)}")
            for ready in cast(list[Connection], wait(list(running))):
                one = running[ready]
                try:
                    outcome = ready.recv()
                except (EOFError, OSError):
                    ready.close()
                    del running[ready]
                    outcomes[one.task.name] = _ended(one.task, one.process, outcomes.get(one.task.name))
                    yield outcomes[one.task.name], time.perf_counter() - one.begun
                    continue
                one.busy = False
                if outcome is not None:  # None: the logs are read
                    outcomes[one.task.name] = outcome
    finally:
        for one in running.values():
            one.process.kill()
            one.process.join()


def _start_steps(
    unstarted: list[Task],
    running: dict[Connection, _Running],
    jobs: int,
    attempt: Attempt,
    outcomes: Mapping[str, StepOutcome],
) -> None:
    """Let steps work whose earlier steps have results, and others read their logs, until ``jobs`` processes are busy.

    Steps are started in their order.
    """
    for connection, one in running.items():
        if one.waiting and not one.busy and _can_run(one.task, outcomes) and _idle(running, jobs):
            with suppress(OSError):  # if it was killed meanwhile, its end is received next
                connection.send(dict(outcomes))
            one.waiting, one.busy, one.begun = False, True, time.perf_counter()
    started = {*outcomes, *(one.task.name for one in running.values())}
    for task in list(unstarted):
        can_run = _can_run(task, outcomes)
        ahead = sum(one.waiting for one in running.values()) < jobs and started.issuperset(task.after)
        if (can_run or ahead) and _idle(running, jobs):
            unstarted.remove(task)
            started.add(task.name)
            connection, other = multiprocessing.Pipe()
            arguments = (other, attempt, task, dict(outcomes) if can_run else None, os.getpid())
            process = multiprocessing.Process(target=_child, args=arguments, daemon=True)
            process.start()
            other.close()  # otherwise the end of the process would not close the pipe
            running[connection] = _Running(task, process, time.perf_counter(), waiting=not can_run)


def _can_run(task: Task, outcomes: Mapping[str, StepOutcome]) -> bool:
    return all(name in outcomes for name in task.after)


def _idle(running: Mapping[Connection, _Running], jobs: int) -> bool:
    """Whether one more process may be busy, without too many that draw their page."""
    drawing = sum(not one.busy and not one.waiting for one in running.values())
    return sum(one.busy for one in running.values()) < jobs and drawing <= jobs


def _load_shared() -> None:
    for name in SHARED:
        with suppress(ImportError, OSError):  # the step that needs a missing package reports it
            import_module(name)
    with suppress(ImportError, OSError, VdynError):
        canvas.load()
        template.load()
        catalog()
    versions()
    gc.freeze()  # a garbage collection in a step's process need not search all that is loaded, which takes 0.1 s


def _ended(task: Task, process: BaseProcess, last: StepOutcome | None) -> StepOutcome:
    """The last outcome that a process sent; a failure if it was killed before its end."""
    process.join()
    if last is not None and process.exitcode == 0:
        return last
    code = process.exitcode or 0
    why = f"signal {-code}" if code < 0 else f"exit code {code}"
    remedy = "run the pipeline again: it reuses the steps that are done"
    finding = Finding(task.name, f"its process ended without a result ({why}): killed, or out of memory", remedy=remedy)
    return StepOutcome(task.name, "failed", reason="its process was killed", problems=(finding,), exit_code=70)


def _child(
    sender: Connection, attempt: Attempt, task: Task, outcomes: Mapping[str, StepOutcome] | None, parent: int
) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the pipeline kills its processes on an interrupt
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    test = None
    with sender:
        if outcomes is None:
            with suppress(Exception):  # what is wrong in the logs is reported when the step reads them itself
                test = logged_test(step_of(task.path), task.path)
            sender.send(None)
            outcomes = sender.recv()
        for outcome in attempt(task, outcomes, test):
            sender.send(outcome)
            if hasattr(os, "nice"):  # the page can wait, other steps cannot
                os.nice(PAGE_NICENESS)


def _end_with(parent: int) -> None:
    """End this process when its parent has ended for any reason."""
    while os.getppid() == parent:
        time.sleep(WATCH)
    os._exit(1)
