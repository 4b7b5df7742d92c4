"""The quality of a log's samples: a state for each sample of a channel, and the faults that led to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

States = NDArray[np.uint8]

EVERY = "all"  # in place of a channel's name: the fault concerns every channel of the log


class Flag(IntEnum):
    """The state of a sample, with QARTOD's codes.

    Source: U.S. Integrated Ocean Observing System, Manual for the Use of Real-Time Oceanographic Data Quality Control
    Flags, version 1.2.
    """

    GOOD = 1
    NOT_EVALUATED = 2
    SUSPECT = 3
    FAILED = 4
    MISSING = 9


@dataclass(frozen=True)
class Fault:
    """A segment of a channel that failed a test, or is suspect.

    Parameters
    ----------
    channel : its name, or ``EVERY``.
    first, stop : indices of the segment's first sample and of the first one after it.
    test : name of the test: frozen, straight_line, spike, dropout; level_step, saturated, clock_gap (suspect).
    why : the fact, with its numbers, as a sentence fragment.
    state : FAILED or SUSPECT.
    """

    channel: str
    first: int
    stop: int
    test: str
    why: str
    state: Flag = Flag.FAILED

    @property
    def samples(self) -> int:
        """The number of samples."""
        return self.stop - self.first


@dataclass(frozen=True, eq=False)
class LogFlags:
    """The quality of one log.

    Parameters
    ----------
    name : of the log.
    states : (n,) codes of ``Flag`` for each channel.
    faults : in the order of their tests; every suspect or failed sample belongs to one.
    """

    name: str
    states: Mapping[str, States]
    faults: tuple[Fault, ...] = ()

    def counts(self, channel: str) -> dict[str, int]:
        """The number of samples in each state that occurs: ``{"good": 990, "missing": 10}``."""
        states, numbers = np.unique(self.states[channel], return_counts=True)
        return {Flag(s).name.lower(): int(k) for s, k in zip(states, numbers, strict=True)}
