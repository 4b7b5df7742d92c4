"""What the program is doing, on one line of a terminal that goes when it is done."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_PROGRAM = logging.getLogger("vdyn_cli")


@contextmanager
def progress_line(name: str, shown: bool) -> Iterator[None]:
    """Show the messages of the program's log, with a clock, where stderr is a terminal.

    Parameters
    ----------
    name : begins the line. shown : whether the user wants to read anything.
    """
    if not shown or sys.stderr is None or not sys.stderr.isatty():
        yield
        return
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as line:
        task = line.add_task(name)

        class Shown(logging.Handler):
            """Writes each message into the line."""

            def emit(self, record: logging.LogRecord) -> None:
                line.update(task, description=f"{name}: {record.getMessage()}")

        handler, before = Shown(logging.INFO), _PROGRAM.level
        _PROGRAM.addHandler(handler)
        _PROGRAM.setLevel(logging.INFO)
        try:
            yield
        finally:
            _PROGRAM.setLevel(before)
            _PROGRAM.removeHandler(handler)
