"""Logs of the hand-held recorder: a first line ``SPINLOG <rate in Hz>``, then one angular speed in rpm per line."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from vdyn_cli.io.reader import ChannelInfo, Column, ReadOptions
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log, LogSource

MARK = "SPINLOG"


class SpinLog:
    """A format of its own."""

    def matches(self, path: Path) -> bool:
        """Whether the file begins with the recorder's mark."""
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return file.read(len(MARK)) == MARK.encode()

    def channels(self, path: Path) -> tuple[ChannelInfo, ...]:
        """The clock and the one channel that there is."""
        time, _ = _parsed(path, path.name)
        span = (float(time[0]), float(time[-1]))
        rate = (time.size - 1) / (span[1] - span[0])
        return ChannelInfo("time", "s", rate, span), ChannelInfo("rpm", "rpm", rate, span)

    def read(self, path: Path, mapping: Mapping[str, Column], options: ReadOptions, name: str) -> Log:
        """The angular speed as written; every channel that is mapped must be called rpm."""
        wrong = [c.column for channel, c in mapping.items() if channel != "time" and c.column != "rpm"]
        if wrong:
            raise InputError(Finding(name, "has no such column", repr(wrong[0]), "its columns are 'time', 'rpm'"))
        time, speed = _parsed(path, name)
        channels = {channel: speed for channel in mapping if channel != "time"}
        return Log(name, time, channels, source=LogSource({c: mapping[c].column for c in mapping}, lambda row: row + 2))


def _parsed(path: Path, name: str) -> tuple[np.ndarray, np.ndarray]:
    head, *lines = path.read_text(encoding="ascii").splitlines()
    try:
        rate, speed = float(head.removeprefix(MARK)), np.array([float(line) if line else np.nan for line in lines])
    except ValueError as error:
        raise InputError(Finding(name, "is not a recording of numbers", str(error), "copy it again")) from None
    return np.arange(speed.size) / rate, speed


READER = SpinLog()
