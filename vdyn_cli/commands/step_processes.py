"""Parallel execution of steps, each in its own process, so that a crash affects only one step."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from vdyn_cli.effects import catalog
from vdyn_cli.project.pipeline import StepOutcome, Task
from vdyn_cli.quantities.errors import Finding, VdynError
from vdyn_cli.report import canvas, template

WATCH = 0.3  # s, interval at which a process checks that the pipeline still runs
# Loaded before the processes are forked, beside matplotlib and the effects; each would otherwise load them in 1 s.
SHARED = (
    "scipy.optimize",
    "jinja2",
    "llvmlite.binding",
    "vdyn_cli.engine.native",
    "vdyn_cli.report.step_page",
)
Attempt = Callable[[Task, Mapping[str, StepOutcome]], Iterator[StepOutcome]]


def side_by_side(
    tasks: Sequence[Task], jobs: int, attempt: Attempt, known: Mapping[str, StepOutcome]
) -> Iterator[tuple[StepOutcome, float]]:
    """Yield the outcome of each step that is not ``known``, and its time, s, when it ends.

    No process outlives the caller.

    Parameters
    ----------
    tasks : all steps. known : outcomes of those that need not run.
    jobs : number of steps to run in parallel.
    attempt : (task, outcomes of other steps) -> its outcomes: with the first, steps that read its result can start; the
        last is the outcome. Must be picklable.

    Raises
    ------
    ValueError : steps come after each other in a circle, or after one that is neither a task nor known.
    """
    outcomes = dict(known)
    waiting = [task for task in tasks if task.name not in outcomes]
    running: dict[Any, tuple[Task, BaseProcess, float]] = {}  # by the connection that the process writes to
    if waiting and multiprocessing.get_start_method() == "fork":
        _load_shared()
    try:
        while waiting or running:
            for task in [t for t in waiting if all(name in outcomes for name in t.after)][: jobs - len(running)]:
                waiting.remove(task)
                receiver, sender = multiprocessing.Pipe(duplex=False)
                arguments = (sender, attempt, task, dict(outcomes), os.getpid())
                started = multiprocessing.Process(target=_child, args=arguments, daemon=True)
                started.start()
                sender.close()  # otherwise the end of the process would not close the pipe
                running[receiver] = task, started, time.perf_counter()
            if not running:
                raise ValueError(f"steps wait for others that never end: {', '.join(t.name for t in waiting)}")
            for ready in wait(list(running)):
                task, process, start = running[ready]
                outcome = _received(ready)
                if outcome is None:
                    del running[ready]
                    outcomes[task.name] = _ended(task, process, outcomes.get(task.name))
                    yield outcomes[task.name], time.perf_counter() - start
                else:
                    outcomes[task.name] = outcome
    finally:
        for _, process, _ in running.values():
            process.kill()
            process.join()


def _load_shared() -> None:
    for name in SHARED:
        with suppress(ImportError, OSError):  # the step that needs a missing package reports it
            import_module(name)
    with suppress(ImportError, OSError, VdynError):
        canvas.load()
        template.load()
        catalog()


def _received(receiver: Any) -> StepOutcome | None:
    """The next outcome that a process sent; None at its end."""
    try:
        outcome: StepOutcome = receiver.recv()
    except (EOFError, OSError):
        receiver.close()
        return None
    return outcome


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


def _child(sender: Connection, attempt: Attempt, task: Task, outcomes: Mapping[str, StepOutcome], parent: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the pipeline kills its processes on an interrupt
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    with sender:
        for outcome in attempt(task, outcomes):
            sender.send(outcome)


def _end_with(parent: int) -> None:
    """End this process when its parent has ended for any reason."""
    while os.getppid() == parent:
        time.sleep(WATCH)
    os._exit(1)
