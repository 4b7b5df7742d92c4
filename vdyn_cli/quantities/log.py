"""A log: named SI channels on one clock. Measurements and simulations have the same type."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding

Samples = tuple[Array, Array]
"""Times (m,), s, and values (m,) as a logger wrote them."""


@dataclass(frozen=True, eq=False)
class LogSource:
    """The place of a log's samples in the file that it was read from.

    Parameters
    ----------
    columns : the file's name of each channel.
    line_of : index of a sample -> its line in the file.
    problems : findings that make the log unusable, collected so that one message can report them all.
    row : the file's word for a sample's place, for messages: line, row, sample.
    others : the mapped channels of the same file on other clocks, one log per clock; all clocks of a file have the same
        origin.
    """

    columns: Mapping[str, str]
    line_of: Callable[[int], int]
    problems: tuple[Finding, ...] = ()
    row: str = "line"
    others: tuple[Log, ...] = ()


@dataclass(frozen=True, eq=False)
class Log:
    """Channels sampled on one strictly increasing clock.

    Parameters
    ----------
    name : for messages, such as the file name.
    time : (n,) s, finite and strictly increasing.
    channels : each (n,), SI, NaN where the logger wrote nothing.
    findings : doubts about the data.
    source : only for a log from a reader, whose channels still have the file's units and signs; else None.
    samples : original samples, on this clock, of channels that were interpolated linearly from another logger; not of
        channels replaced since. Of a part of a log, those of the whole log.
    averaged : likewise, of channels that were averaged from a faster logger.
    begin : zero of a clock recorded as times of day: s since 1970, or since midnight if no date is stated; NaN for
        other clocks.
    clock_std : by channel of another logger, standard error of its clock's estimated delay over this run, s.
    held : by channel whose values the logger held for several rows, the time of one row, s: a value may have been
        sampled anywhere in the row before it appears.

    Notes
    -----
    Arrays are stored as read-only views, so that no step can modify a measurement. ``log["speed"]`` is a channel,
    ``log["time"]`` the clock.

    Raises
    ------
    ValueError : the clock does not increase, or a channel has another length. These are programming errors: a reader
        reports a bad file before it creates a log.
    """

    name: str
    time: Array
    channels: Mapping[str, Array]
    findings: tuple[Finding, ...] = ()
    source: LogSource | None = None
    samples: Mapping[str, Samples] = field(default_factory=dict)
    averaged: Mapping[str, Samples] = field(default_factory=dict)
    begin: float = math.nan
    clock_std: Mapping[str, float] = field(default_factory=dict)
    held: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        time = _frozen(self.time)
        ends = time[:: max(time.size - 1, 1)] if time.ndim == 1 else time
        if time.ndim != 1 or not np.isfinite(ends).all() or not (time[1:] > time[:-1]).all():
            raise ValueError(f"log '{self.name}': time must be finite and strictly increasing")
        channels = {key: _frozen(values) for key, values in self.channels.items()}
        wrong = [key for key, values in channels.items() if values.shape != time.shape]
        if wrong:
            raise ValueError(f"log '{self.name}': {', '.join(wrong)} not as long as time ({time.size} samples)")
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "channels", channels)

    def __contains__(self, name: object) -> bool:
        return name == "time" or name in self.channels

    def __getitem__(self, name: str) -> Array:
        return self.time if name == "time" else self.channels[name]

    @property
    def duration(self) -> float:
        """Time from the first to the last sample, s."""
        return float(self.time[-1] - self.time[0]) if self.time.size else 0.0

    def place(self, channel: str) -> str:
        """File and column of a channel, for messages."""
        return f"{self.name}, column '{self.source.columns[channel]}'" if self.source else f"{self.name}, {channel}"

    def line(self, sample: int) -> int:
        """The file's line of a sample; its number, counted from 1, if the log was not read from a file."""
        return self.source.line_of(sample) if self.source else sample + 1

    @property
    def row(self) -> str:
        """The word for a sample's place in the file, for messages: line, row, sample."""
        return self.source.row if self.source else "line"

    def between(self, start: float, stop: float) -> Log:
        """The part with start <= time <= stop (s on the log's clock), as views; it may have no samples."""
        first, last = np.searchsorted(self.time, start, "left"), np.searchsorted(self.time, stop, "right")
        part = slice(first, last)
        return replace(self, time=self.time[part], channels={k: v[part] for k, v in self.channels.items()})

    def with_channels(self, **channels: ArrayLike) -> Log:
        """The same log with channels added or replaced."""
        added = {key: np.asarray(values, dtype=float) for key, values in channels.items()}
        samples, averaged = (
            {key: read for key, read in kept.items() if key not in added} for kept in (self.samples, self.averaged)
        )
        return replace(self, channels={**self.channels, **added}, samples=samples, averaged=averaged)

    def __sub__(self, other: Log) -> Log:
        """The difference of the channels that both logs have.

        Raises
        ------
        ValueError : the clocks differ; nothing is interpolated.
        """
        if not np.array_equal(self.time, other.time):
            raise ValueError(f"'{self.name}' and '{other.name}' are not on the same clock")
        shared = {key: self[key] - other[key] for key in self.channels if key in other.channels}
        return Log(f"{self.name} - {other.name}", self.time, shared)


def _frozen(values: ArrayLike) -> Array:
    view = np.asarray(values, dtype=np.float64).view()
    view.flags.writeable = False
    return view
