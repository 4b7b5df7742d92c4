"""Difference between the clocks of two loggers: delay and drift, each with its standard error."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from pydantic import Field

from vdyn_cli.quantities.entry import Entry

if TYPE_CHECKING:
    from vdyn_cli.quantities.arrays import Array


class ClockDifference(Entry):
    """Clock of a logger relative to the first one's: at time t of the first, it shows t + delay + drift (t - at)."""

    run: str = Field(description="log of the first logger, which is the reference")
    logger: str = Field(description="log of the other logger")
    pair: tuple[str, str] = Field(
        description="channels from which the delay is estimated; 'time' twice where the description states it"
    )
    delay: float = Field(description="by which the other logger's clock is ahead, s")
    delay_std: float = Field(description="standard error of the delay, s; the parameters' intervals contain it")
    at: float = Field(description="time of the first logger for which the delay holds, s")
    drift: float = Field(description="change of the delay over time, s/s")
    drift_std: float = Field(description="standard error of the drift, s/s")
    corrected: bool = Field(description="true: the drift is removed; false: it is not significant and left in")
    gain: float = Field(description="second channel over first, in SI units")
    offset: float = Field(
        description="constant by which the second channel exceeds gain times the first, in its SI unit"
    )
    channels: tuple[str, ...] = Field(description="channels that were resampled from the other logger")

    @property
    def stated(self) -> bool:
        """Whether the delay is stated, not estimated."""
        return self.pair == ("time", "time")

    def stamp(self, time: Array) -> Array:
        """Times (n,) of the logger's clock, s, at times (n,) of the reference's clock: t + delay + drift (t - at)."""
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
