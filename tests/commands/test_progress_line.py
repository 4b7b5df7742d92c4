"""The progress line on a terminal."""

from __future__ import annotations

import io
import logging

import pytest

from vdyn_cli.commands.progress_line import progress_line


class Terminal(io.StringIO):
    """A terminal that keeps what is written."""

    def isatty(self) -> bool:
        return True


def test_a_terminal_shows_what_is_done_and_nothing_remains_attached(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal, log = Terminal(), logging.getLogger("vdyn_cli")
    monkeypatch.setattr("sys.stderr", terminal)
    with progress_line("coastdown", shown=True):
        logging.getLogger("vdyn_cli.project.execute").info("fitting")
    assert "coastdown: fitting" in terminal.getvalue()
    assert not log.handlers


@pytest.mark.parametrize(("stream", "shown"), [(io.StringIO(), True), (Terminal(), False)])
def test_a_file_and_a_quiet_run_show_nothing(stream: io.StringIO, shown: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr", stream)
    with progress_line("coastdown", shown=shown):
        logging.getLogger("vdyn_cli.project.execute").info("fitting")
    assert not stream.getvalue()
