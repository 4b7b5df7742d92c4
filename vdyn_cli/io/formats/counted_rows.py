"""A file without a clock whose rows have a fixed rate, given a clock that counts them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.io.formats.stored_channels import StoredChannel, StoredFile
from vdyn_cli.io.reader import COUNTED
from vdyn_cli.quantities.arrays import Array

_ROWS = "rows"  # in the key of a clock of this module


@dataclass(frozen=True)
class CountedRows:
    """The channels of ``file``, with a clock for each of its tables: row number / rate, from 0 s.

    Parameters
    ----------
    file : an open file. rate : of its rows, Hz.
    """

    file: StoredFile
    rate: float

    @property
    def row(self) -> str:
        """The file's word for a sample's place."""
        return self.file.row

    @property
    def listed(self) -> Sequence[StoredChannel]:
        """The channels of the file, and the clocks."""
        tables = dict.fromkeys(c.table for c in self.file.listed)
        clocks = [StoredChannel(COUNTED.column, "s", table, (_ROWS, table), master=True) for table in tables]
        return (*clocks, *(c for c in self.file.listed if not c.master))

    def line(self, channel: StoredChannel, row: int) -> int:
        """The number in the file of a row, which a clock has from its table."""
        return self.file.line(self._beside(channel)[0] if _is_clock(channel) else channel, row)

    def columns(self, wanted: Sequence[StoredChannel]) -> Sequence[Array | None]:
        """The samples of channels of one table."""
        own = [c for c in wanted if not _is_clock(c)]
        found = iter(self.file.columns(own)) if own else iter(())
        return [self._clock(c) if _is_clock(c) else next(found) for c in wanted]

    def _clock(self, clock: StoredChannel) -> Array | None:
        for beside in self._beside(clock):
            if (values := self.file.columns([beside])[0]) is not None:
                return np.arange(values.size) / self.rate
        return None

    def _beside(self, clock: StoredChannel) -> list[StoredChannel]:
        return [c for c in self.file.listed if c.table == clock.table]


def _is_clock(channel: StoredChannel) -> bool:
    return isinstance(channel.at, tuple) and channel.at[:1] == (_ROWS,)
