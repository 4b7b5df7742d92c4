"""ASAM MDF 4 (and 3) measurements, read with asammdf: each group of channels on its own clock, in the file's units.

Samples that the file marks as invalid are NaN. Values with a conversion to text are read as the numbers before it.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from vdyn_cli.io.formats.stored_channels import (
    StoredChannel,
    damage_reported,
    damaged_file,
    missing_library,
    refuse_missing,
)
from vdyn_cli.io.formats.stored_reader import StoredReader
from vdyn_cli.quantities.arrays import Array

_MAGIC = (b"MDF     ", b"UnFinMF ")
_FRAGMENT = 1 << 20  # bytes that asammdf reads at a time; larger fragments cost memory and save no time


class _MdfFile:
    """An open measurement."""

    row = "sample"

    def __init__(self, mdf: Any, path: Path) -> None:
        self._mdf, self._path = mdf, path
        self.listed = tuple(_listed(mdf))

    def line(self, channel: StoredChannel, row: int) -> int:
        """The number of a sample, counted from 1."""
        return row + 1

    def columns(self, wanted: Sequence[StoredChannel]) -> Sequence[Array | None]:
        """The samples of channels of one group, read together."""
        group = int(str(wanted[0].table))
        found: dict[StoredChannel, Array | None] = {}
        signals = [c for c in wanted if not c.master]
        with damage_reported(self._path, "asammdf", Exception):
            if signals:
                places = [(None, group, c.at[1]) for c in signals if isinstance(c.at, tuple)]
                read = self._mdf.select(places, copy_master=False, ignore_value2text_conversions=True)
                time = read[0].timestamps
                for channel in signals:
                    found[channel] = _numbers(read.pop(0))  # each is freed as soon as it is converted
            else:
                time = self._mdf.get_master(group)
        return [np.asarray(time, dtype=float) if c.master else found[c] for c in wanted]


def _listed(mdf: Any) -> Iterator[StoredChannel]:
    """The channels of all groups; of groups without samples only the names that no other group has."""
    filled = {c.name for group in mdf.groups if group.channel_group.cycles_nr for c in group.channels}
    for number, group in enumerate(mdf.groups):
        called = _group_name(group, number)
        device = _source_name(getattr(group.channel_group, "acq_source", None))
        master = mdf.masters_db.get(number)
        for index, channel in enumerate(group.channels):
            if not group.channel_group.cycles_nr and channel.name in filled:
                continue
            source = _source_name(channel.source) or device
            is_master = index == master
            unit = "s" if is_master else (mdf.get_channel_unit(group=number, index=index) or "")
            yield StoredChannel(channel.name, unit.strip(), number, (number, index), called, source, is_master)


def _group_name(group: Any, number: int) -> str:
    """The acquisition name, the comment's first line, or the group's number."""
    block = group.channel_group
    texts = (getattr(block, "acq_name", None), getattr(block, "comment", None))
    plain = next((t.strip().splitlines()[0].strip() for t in texts if t and t.strip() and "<" not in t), "")
    return plain or f"group {number + 1}"


def _source_name(source: Any) -> str:
    if source is None:
        return ""
    return str(getattr(source, "name", "") or getattr(source, "path", "") or "").strip()


def _numbers(signal: Any) -> Array | None:
    """The samples as floating-point numbers, NaN where marked invalid; None if they are not scalars."""
    samples = signal.samples
    if samples.ndim != 1 or samples.dtype.kind not in "biuf":
        return None
    values = samples.astype(np.float64)
    invalid = signal.invalidation_bits
    if invalid is not None:
        values[np.asarray(invalid, dtype=bool)] = np.nan
    return np.asarray(values)


@contextmanager
def _opened(path: Path) -> Iterator[_MdfFile]:
    refuse_missing(path)
    try:
        from asammdf import MDF
    except ImportError:
        missing_library(path, "asammdf", "mdf", "an MDF measurement")
    # A file object keeps asammdf from mapping the whole file into memory.
    with path.open("rb") as stream:
        mdf = _parsed(MDF, stream, path)
        with damage_reported(path, "asammdf", Exception):
            mdf.configure(read_fragment_size=_FRAGMENT)
            file = _MdfFile(mdf, path)
        try:
            yield file
        finally:
            mdf.close()


def _parsed(parser: Any, stream: BinaryIO, path: Path) -> Any:
    """The measurement as parsed by asammdf.

    Raises
    ------
    InputError : the file is damaged.
    """
    try:
        return parser(stream)
    except Exception as error:  # its parser raises many types: struct.error, KeyError, MdfException
        refusal = damaged_file(path, "asammdf", error)
    hook = sys.unraisablehook
    sys.unraisablehook = lambda _: None  # the incomplete object prints an error when it is deleted
    gc.collect()
    sys.unraisablehook = hook
    raise refusal


READER = StoredReader(lambda head, path: head.startswith(_MAGIC), _opened)
