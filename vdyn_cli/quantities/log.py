"""A log: named SI channels on one clock. A measurement, a simulation and a fit are the same type."""

from __future__ import annotations

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
    """Where the samples of a log stand in the file that it was read from.

    Parameters
    ----------
    columns : the file's name of each channel.
    line_of : the file's line of a sample.
    problems : what makes the log unusable, kept so that one message holds them and those of its channels.
    row : what the file calls a sample's place, in messages: line, row, sample.
    others : the mapped channels of the same file that stand on other clocks, one log a clock; all clocks of a file
        count the time from the same moment.
    """

    columns: Mapping[str, str]
    line_of: Callable[[int], int]
    problems: tuple[Finding, ...] = ()
    row: str = "line"
    others: tuple[Log, ...] = ()


@dataclass(frozen=True, eq=False)
class Log:
    """Channels sampled on one strictly rising clock.

    Parameters
    ----------
    name : what the user calls it, such as the file name.
    time : (n,) s, finite and strictly increasing.
    channels : each (n,), SI, NaN where the logger wrote nothing.
    findings : what is doubtful about the data.
    source : of a log as a reader gives it, whose channels still have the file's units and signs; None for all others.
    samples : on this clock, of channels whose values lie on straight lines between the samples of another logger; of
        no channel that was replaced since, and of the whole log where this is a part.

    Notes
    -----
    Arrays are kept as read-only views, so no step can edit a measurement in place. ``log["speed"]`` gives a
    channel and ``log["time"]`` the clock.

    Raises
    ------
    ValueError : a clock that does not rise or a channel of another length; both are programming errors here,
        since the reader reports a user's bad file before it makes a log.
    """

    name: str
    time: Array
    channels: Mapping[str, Array]
    findings: tuple[Finding, ...] = ()
    source: LogSource | None = None
    samples: Mapping[str, Samples] = field(default_factory=dict)

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
        """The file's line of a sample; its number, counted from 1, where the log was not read from a file."""
        return self.source.line_of(sample) if self.source else sample + 1

    @property
    def row(self) -> str:
        """What a sample's place in the file is called in messages: line, row, sample."""
        return self.source.row if self.source else "line"

    def between(self, start: float, stop: float) -> Log:
        """The part with start <= time <= stop, as views; empty when no sample lies there."""
        first, last = np.searchsorted(self.time, start, "left"), np.searchsorted(self.time, stop, "right")
        part = slice(first, last)
        return replace(self, time=self.time[part], channels={k: v[part] for k, v in self.channels.items()})

    def with_channels(self, **channels: ArrayLike) -> Log:
        """The same log with channels added or replaced."""
        added = {key: np.asarray(values, dtype=float) for key, values in channels.items()}
        samples = {key: read for key, read in self.samples.items() if key not in added}
        return replace(self, channels={**self.channels, **added}, samples=samples)

    def __sub__(self, other: Log) -> Log:
        """The difference of the channels that both have; the clocks must be the same.

        Raises
        ------
        ValueError : another clock. Nothing is interpolated to make a difference possible.
        """
        if not np.array_equal(self.time, other.time):
            raise ValueError(f"'{self.name}' and '{other.name}' are not on the same clock")
        shared = {key: self[key] - other[key] for key in self.channels if key in other.channels}
        return Log(f"{self.name} - {other.name}", self.time, shared)


def _frozen(values: ArrayLike) -> Array:
    view = np.asarray(values, dtype=np.float64).view()
    view.flags.writeable = False
    return view
