"""Difference between the clocks of two loggers: delay and drift, each with its standard error."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vdyn_cli.quantities.arrays import Array


@dataclass(frozen=True)
class ClockDifference:
    """The clock of a logger relative to that of the reference: at the reference's time t, the logger's clock shows::

        t + delay + drift (t - at)

    Parameters
    ----------
    run, logger : names of the reference's log and of the logger's.
    pair : the channel of the reference and that of the logger, from which the difference is estimated; both are
        ``time`` where the delay is stated.
    delay, delay_std, at : s; the delay holds at the time ``at`` of the reference's clock.
    drift, drift_std : s/s.
    corrected : true: delay and drift are removed; false: only the delay, because the drift is not significant.
    gain, offset : the logger's channel = gain x the reference's + offset.
    channels : names of the channels taken from this logger, resampled to the reference's clock.
    """

    run: str
    logger: str
    pair: tuple[str, str]
    delay: float
    delay_std: float
    at: float
    drift: float
    drift_std: float
    corrected: bool
    gain: float
    offset: float
    channels: tuple[str, ...] = ()

    @property
    def stated(self) -> bool:
        """Whether the delay is stated, not estimated."""
        return self.pair == ("time", "time")

    def stamp(self, time: Array) -> Array:
        """Times of the logger's clock, s, at times of the reference's clock."""
        rate = self.drift if self.corrected else 0.0
        return time + self.delay + rate * (time - self.at)

    def run_delay_std(self, time: Array) -> float:
        """Standard error of the delay over a run, s: that at ``at`` plus the rms effect of an uncorrected drift.

        Parameters
        ----------
        time : (n,) s, of the run's samples, on the reference's clock.
        """
        if self.corrected or not math.isfinite(self.drift_std):
            return self.delay_std
        return math.hypot(self.delay_std, self.drift_std * math.sqrt(((time - self.at) ** 2).mean()))

    def to_json(self) -> dict[str, Any]:
        """The entry for a result's JSON."""
        return {**vars(self), "pair": list(self.pair), "channels": list(self.channels)}

    @classmethod
    def from_json(cls, part: Mapping[str, Any]) -> ClockDifference:
        """The object from an entry of ``to_json``."""
        first, second = part["pair"]
        return cls(**{**part, "pair": (first, second), "channels": tuple(part["channels"])})
