"""A progress line on the terminal, which disappears at the end."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_PROGRAM = logging.getLogger("vdyn_cli")


@contextmanager
def progress_line(name: str, shown: bool) -> Iterator[None]:
    """Context that shows the program's log messages and the elapsed time on one line, if stderr is a terminal.

    Parameters
    ----------
    name : start of the line. shown : False (quiet) shows nothing.
    """
    if not shown or sys.stderr is None or not sys.stderr.isatty():
        yield
        return
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as line:
        task = line.add_task(name)

        class LineHandler(logging.Handler):
            """Shows each message on the line."""

            def emit(self, record: logging.LogRecord) -> None:
                line.update(task, description=f"{name}: {record.getMessage()}")

        handler, before = LineHandler(logging.INFO), _PROGRAM.level
        _PROGRAM.addHandler(handler)
        _PROGRAM.setLevel(logging.INFO)
        try:
            yield
        finally:
            _PROGRAM.setLevel(before)
            _PROGRAM.removeHandler(handler)
