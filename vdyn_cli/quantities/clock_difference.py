"""How one logger's clock differs from another's: delay and drift, each with its standard error."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vdyn_cli.quantities.arrays import Array


@dataclass(frozen=True)
class ClockDifference:
    """The clock of a logger against that of the reference: what the reference stamps t, the logger stamps::

        t + delay + drift (t - at)

    Parameters
    ----------
    run, logger : names of the reference's log and of the logger's.
    pair : the channel of the reference and that of the logger, from which the difference is estimated; both are
        ``time`` where the delay is stated.
    delay, delay_std, at : s; ``at`` is the moment, on the reference's clock, for which the delay holds.
    drift, drift_std : s/s.
    corrected : whether the drift is corrected; else the delay alone.
    gain, offset : of the logger's channel over the reference's.
    channels : taken from this logger, resampled to the reference's clock.
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
        """The logger's times, s, of times on the reference's clock."""
        rate = self.drift if self.corrected else 0.0
        return time + self.delay + rate * (time - self.at)

    def run_delay_std(self, time: Array) -> float:
        """Standard error of the delay over a run, s: that at ``at``, and the rms of a drift that is not corrected.

        Parameters
        ----------
        time : (n,) of the run, s, on the reference's clock.
        """
        if self.corrected or not math.isfinite(self.drift_std):
            return self.delay_std
        return math.hypot(self.delay_std, self.drift_std * math.sqrt(((time - self.at) ** 2).mean()))

    def to_json(self) -> dict[str, Any]:
        """As the JSON writes it."""
        return {**vars(self), "pair": list(self.pair), "channels": list(self.channels)}

    @classmethod
    def from_json(cls, part: Mapping[str, Any]) -> ClockDifference:
        """What ``to_json`` wrote."""
        first, second = part["pair"]
        return cls(**{**part, "pair": (first, second), "channels": tuple(part["channels"])})
