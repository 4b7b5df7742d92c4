"""TDMS measurements of LabVIEW and DIAdem, read with npTDMS: each group of channels on its own clock.

A waveform has its clock in its properties: start time, offset and increment; the clock is named ``time``, and all
clocks count from the first start in the file. Other channels have the clock of their group's time channel.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from vdyn_cli.io.formats.stored_channels import StoredChannel, damage_reported, missing_library, refuse_missing
from vdyn_cli.io.formats.stored_reader import StoredReader
from vdyn_cli.io.reader import is_clock
from vdyn_cli.quantities.arrays import Array

_CLOCK = "time"
_UNITS = ("unit_string", "NI_UnitDescription")
_START, _OFFSET, _STEP, _X_UNIT = "wf_start_time", "wf_start_offset", "wf_increment", "wf_xunit_string"


class _TdmsFile:
    """An open measurement."""

    row = "sample"

    def __init__(self, file: Any, path: Path) -> None:
        self._path = path
        self._channels = [channel for group in file.groups() for channel in group.channels()]
        starts = [c.properties[_START] for c in self._channels if _START in c.properties]
        self._first = min(starts, default=None)
        since = np.nan if self._first is None else (self._first - np.datetime64(0, "s")) / np.timedelta64(1, "s")
        self._begin = float(since)
        self.listed = tuple(self._listed())

    def _listed(self) -> Iterator[StoredChannel]:
        """The channels, and a clock before the first of each table of waveforms whose group has no time channel."""
        timed = {(c.group_name, len(c)) for c in self._channels if is_clock(c.name)}
        clocks: set[Hashable] = set()
        for at, channel in enumerate(self._channels):
            rows = (channel.group_name, len(channel))
            own = rows not in timed and _STEP in channel.properties
            table = (channel.group_name, *self._timing(channel), len(channel)) if own else rows
            if own and table not in clocks:
                clocks.add(table)
                unit = str(channel.properties.get(_X_UNIT) or "s")
                own_clock = (at, _CLOCK)
                yield StoredChannel(_CLOCK, unit, table, own_clock, channel.group_name, "", True, self._begin)
            unit = next((str(channel.properties[k]).strip() for k in _UNITS if channel.properties.get(k)), "")
            unit = "s" if channel.dtype.kind == "M" else unit
            yield StoredChannel(channel.name, unit, table, (at, "samples"), channel.group_name)

    def _timing(self, channel: Any) -> tuple[float, float]:
        """Time of a waveform's first sample after the file's first start, and the time between samples, s."""
        start = channel.properties.get(_START, self._first)
        after = 0.0 if start is None else float((start - self._first) / np.timedelta64(1, "ns")) / 1e9
        return after + float(channel.properties.get(_OFFSET, 0.0)), float(channel.properties[_STEP])

    def line(self, channel: StoredChannel, row: int) -> int:
        """The number of a sample, counted from 1."""
        return row + 1

    def columns(self, wanted: Sequence[StoredChannel]) -> Sequence[Array | None]:
        """The samples, scaled as the file states."""
        with damage_reported(self._path, "npTDMS", Exception):
            return [self._column(channel) for channel in wanted]

    def _column(self, wanted: StoredChannel) -> Array | None:
        at = wanted.at[0] if isinstance(wanted.at, tuple) else -1
        channel = self._channels[at]
        if wanted.master:
            first, step = self._timing(channel)
            return np.asarray(first + step * np.arange(len(channel)))
        samples = np.asarray(channel[:])
        if samples.dtype.kind == "M":
            return np.asarray((samples - samples[:1]) / np.timedelta64(1, "ns") / 1e9)
        return samples.astype(np.float64) if samples.dtype.kind in "biuf" else None


@contextmanager
def _opened(path: Path) -> Iterator[_TdmsFile]:
    refuse_missing(path)
    try:
        from nptdms import TdmsFile
    except ImportError:
        missing_library(path, "npTDMS", "tdms", "a TDMS measurement")
    # A file object keeps npTDMS from reading an index file beside it, which may be of another recording.
    with path.open("rb") as stream:
        with damage_reported(path, "npTDMS", Exception):
            opened = TdmsFile.open(stream)
            file = _TdmsFile(opened, path)
        try:
            yield file
        finally:
            opened.close()


READER = StoredReader(lambda head, path: head.startswith(b"TDSm"), _opened)
