"""Segments in which all channels of a clock repeat their values and then jump: the logger stopped and went on."""

from __future__ import annotations

import numpy as np

from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.arrays import Array, Mask, spans

_FEWEST_CHANNELS = 3  # that all repeat: a speed and an engine's rpm of coarse resolution may both be constant
_SHORTEST = 5.0  # s
_FEWEST_SAMPLES = 5
_SWITCH = 16  # distinct values: a channel with no more may be constant for any time


class Stalls:
    """Collects the channels of one clock, one after another."""

    def __init__(self, time: Array) -> None:
        self.time = time
        self._channels = 0
        self._repeats: Mask = np.ones(time.size, dtype=bool)
        self._jumps: Mask = np.zeros(time.size, dtype=bool)

    def add(self, values: Array) -> None:
        """Take a channel (n,), NaN where no value was written, into account, unless it has few distinct values."""
        rows = np.flatnonzero(np.isfinite(values))
        steps = np.abs(np.diff(values[rows]))
        if np.unique(values[rows[1:]][steps > 0.0]).size <= _SWITCH:
            return
        self._channels += 1
        changed = rows[1:][steps > 0.0]
        self._repeats[changed] = False
        usual = float(np.quantile(steps[steps > 0.0], 0.99))
        before = values[rows[:-1]][steps > 0.0]  # zero is a car at rest, whose acceleration may begin with a jump
        self._jumps[changed] |= (steps[steps > 0.0] > QUALITY.exit_jump * usual) & (before != 0.0)

    def found(self) -> tuple[tuple[float, float], ...]:
        """First and last time, s, of each segment; a parked car's end without a jump, and do not count."""
        if self._channels < _FEWEST_CHANNELS:
            return ()
        self._repeats[0] = False
        return tuple(
            (float(self.time[a - 1]), float(self.time[b - 1]))
            for a, b in spans(self._repeats)
            if b - a >= _FEWEST_SAMPLES
            and self.time[b - 1] - self.time[a - 1] >= _SHORTEST
            and b < self.time.size
            and self._jumps[b]
        )
