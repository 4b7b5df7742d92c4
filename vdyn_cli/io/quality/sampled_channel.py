"""One channel of a log at the rows where it has a value, with what the tests of its quality need."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vdyn_cli.io.clocks.held_values import held_rows
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.io.quality.regular_segments import (
    Continuation,
    Spans,
    alternating,
    equal,
    nearly_straight,
    quantum,
    straight,
)
from vdyn_cli.quantities.arrays import Array, Mask, Rows, spans
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import from_si
from vdyn_cli.quantities.vocabulary import CHANNELS, COMMANDS, VARYING, WHEEL_SPEEDS

SPEEDS = ("speed", "vehicle_speed", "wheel_speed", *WHEEL_SPEEDS)
RADIUS = 0.3  # m, approximate wheel radius for converting wheel speed to vehicle speed


@dataclass(frozen=True, eq=False)
class SampledChannel:
    """A channel at the rows (m,) where it has a value."""

    name: str
    rows: Rows
    time: Array
    values: Array
    moving: Mask  # (m,)
    unit: str  # for messages

    def text(self, value: float, digits: int = 5, step: bool = False) -> str:
        """Text of a value, or of a step between two values, in the channel's unit."""
        si_unit = CHANNELS[self.name].unit if self.name in CHANNELS else ""
        shown = from_si(value, self.unit, si_unit) - (from_si(0.0, self.unit, si_unit) if step else 0.0)
        return f"{shown:.{digits}g} {self.unit}".rstrip()

    @cached_property
    def resolution(self) -> float:
        """Step of its quantization, SI."""
        return quantum(self.values)

    @cached_property
    def equal(self) -> Mask:
        """Whether each value (m,) equals the one before."""
        return equal(self.values)

    @cached_property
    def straight(self) -> Mask:
        """Where it follows a straight line over rows or time, since loggers interpolate over either; rests included,
        as other channels may rise meanwhile."""
        tolerance = QUALITY.flat_step * self.resolution
        by_rows = straight(np.arange(self.time.size, dtype=float), self.values, tolerance)
        return by_rows | straight(self.time, self.values, tolerance)

    def places(self, a: int, b: int) -> tuple[Array, Array]:
        """Times and row numbers of a segment, over either of which a logger may interpolate."""
        return self.time[a:b], np.arange(a, b, dtype=float)

    @cached_property
    def resting(self) -> Continuation:
        """Probability that a rest continues."""
        return Continuation.of(self.equal, self.moving)

    @cached_property
    def bending(self) -> Continuation:
        """Probability that a straight line continues; a command's rests are not lines."""
        little = nearly_straight(self.values, QUALITY.flat_step * self.resolution / 2.0)
        return Continuation.of(little if self.varies or self.rests else little & ~self.equal, self.moving)

    @cached_property
    def still(self) -> Mask:
        """Where it rests; a rounded line that moves by single quanta in one direction does not count."""
        still = self.equal.copy()
        for a, b in spans(self.equal):
            if a > 1 and b < self.values.size:
                entered, left = self.values[a - 1] - self.values[a - 2], self.values[b] - self.values[b - 1]
                still[a:b] = entered * left <= 0.0 or max(abs(entered), abs(left)) > 1.5 * self.resolution
        return still

    @cached_property
    def _flickers(self) -> Rows:
        """Number (m + 1,) of samples before each whose bend changes sign; of held values, of the readings alone, since
        a held ramp 0, 0, 8, 8, 16, 16 bends up and down without noise."""
        own = held_rows(self.values)
        own = np.arange(self.values.size) if own is None else own
        flickers = np.zeros(self.values.size, dtype=bool)
        flickers[own] = alternating(self.values[own], QUALITY.flat_step * self.resolution / 2.0)
        return np.concatenate([[0], np.cumsum(flickers)])

    @cached_property
    def usual_step(self) -> float:
        """99 % quantile of the steps between two samples."""
        steps = np.abs(np.diff(self.values))
        return float(np.quantile(steps[steps > 0.0], 0.99)) if np.any(steps) else 0.0

    @cached_property
    def usual_bend(self) -> float:
        """Median magnitude of x_k - 2 x_k-1 + x_k-2 where the car moves: 1.65 standard deviations of white noise."""
        bends = np.abs(np.diff(self.values, 2))[self.moving[2:]]
        return float(np.median(bends)) if bends.size else 0.0

    def breaks_off(self, a: int, b: int) -> bool:
        """Whether the channel has noise outside of a segment, or the segment ends with a jump."""
        elsewhere = int(self._flickers[-1] - self._flickers[b] + self._flickers[a])
        return elsewhere >= QUALITY.fewest_flickers or jumps(self, b)

    @property
    def varies(self) -> bool:
        """Whether a working sensor's reading always varies; this includes a command that is noisy when idle."""
        return self.name in VARYING or (self.name in COMMANDS and not self._idles)

    @cached_property
    def _idles(self) -> bool:
        """Whether the channel rests repeatedly, as a command does and a torque sensor does not."""
        rests = [1 for a, b in spans(self.equal) if b - a + 1 >= QUALITY.shortest_segment]
        return len(rests) >= QUALITY.fewest_rests

    @property
    def rests(self) -> bool:
        """Whether it may be constant, or change linearly, for any time: neither a varying reading nor a command."""
        return not (self.varies or self.name in COMMANDS)


def jumps(channel: SampledChannel, at: int) -> bool:
    """Whether the step to sample ``at`` exceeds the usual ones by ``exit_jump``; False behind the last sample."""
    jump = abs(channel.values[at] - channel.values[at - 1]) if at < channel.values.size else 0.0
    return bool(jump > QUALITY.exit_jump * channel.usual_step > 0.0)


def sampled_channel(log: Log, name: str, unit: str) -> SampledChannel:
    """A channel of a log at the rows where it has a value; ``unit`` is its unit in messages."""
    rows = np.flatnonzero(np.isfinite(log[name]))
    return SampledChannel(name, rows, log.time[rows], log[name][rows], _moving(log)[rows], unit)


def _moving(log: Log) -> Mask:
    """Mask (n,) of samples at which any speed shows that the car moves; all if there is no speed."""
    known = [n for n in SPEEDS if n in log]
    if not known:
        return np.ones(log.time.size, dtype=bool)
    scale = {n: RADIUS if n.startswith("wheel") else 1.0 for n in known}
    faster = [np.nan_to_num(np.abs(log[n]), nan=np.inf) * scale[n] > QUALITY.standing_speed for n in known]
    return np.asarray(np.any(faster, axis=0))


def lasting(found: Spans, time: Array) -> Spans:
    """The segments, of samples at ``time`` (m,), that last at least ``QUALITY.shortest_time``."""
    return [(a, b) for a, b in found if time[b - 1] - time[a] >= QUALITY.shortest_time]
