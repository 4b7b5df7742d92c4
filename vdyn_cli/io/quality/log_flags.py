"""Quality flags of every sample of a log, from tests of each channel and of all channels together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.quality.channel_quality import saturated_spans
from vdyn_cli.io.quality.clock_gaps import clock_gaps
from vdyn_cli.io.quality.command_rests import contradicted_rests, drive_tie, off_source_grid
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.io.quality.regular_segments import (
    LINE,
    Continuation,
    Spans,
    alternating,
    equal,
    improbable_segments,
    merged,
    nearly_straight,
    quantum,
    rounded_line,
    straight,
)
from vdyn_cli.io.quality.spikes import dropouts, level_step, spikes
from vdyn_cli.quantities.arrays import Array, Mask, Rows, spans
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quality_flags import EVERY, Fault, Flag, LogFlags
from vdyn_cli.quantities.quantity import from_si
from vdyn_cli.quantities.vocabulary import CHANNELS, COMMANDS, VARYING, WHEEL_SPEEDS

_FEWEST_SAMPLES = 50  # samples; a channel with fewer is not tested
SPEEDS = ("speed", "vehicle_speed", "wheel_speed", *WHEEL_SPEEDS)
_LOADS = tuple(n for n in CHANNELS if n.endswith(("_load", "force_z")))
_BESIDE = 5.0  # readings between a step of a speed and standstill, before or after it
_AT_REST = 0.05  # share of the step, largest speed at standstill
_RADIUS = 0.3  # m, approximate wheel radius for converting wheel speed to vehicle speed


@dataclass(frozen=True, eq=False)
class _Sampled:
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
        return quantum(self.values)

    @cached_property
    def equal(self) -> Mask:
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
        """Number (m + 1,) of samples before each whose bend changes sign."""
        tolerance = QUALITY.flat_step * self.resolution / 2.0
        return np.concatenate([[0], np.cumsum(alternating(self.values, tolerance))])

    @cached_property
    def _usual_step(self) -> float:
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
        jump = abs(self.values[b] - self.values[b - 1]) if b < self.values.size else 0.0
        return elsewhere >= QUALITY.fewest_flickers or bool(jump > QUALITY.exit_jump * self._usual_step > 0.0)

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


def flags(log: Log, units: Mapping[str, str] | None = None) -> LogFlags:
    """The state of every sample of a log's channels, and the faults that the tests found.

    Failed: all channels frozen or linearly interpolated at once; one channel frozen, linearly interpolated or dropped
    out to one value; single-sample spikes. Suspect: a speed or load after a permanent jump, peaks at a sensor's limit,
    the sample after a gap of the clock (channel ``time``). A standstill of the car, coarse quantization and channels
    that may be constant are not faults. A channel with fewer than 50 values is not evaluated.

    Parameters
    ----------
    log : channels in SI, (n,) each, NaN where no value was recorded.
    units : unit of each channel in messages; SI for channels not listed.

    Returns
    -------
    LogFlags : computed in O(n log n) time and O(n) memory for each channel.
    """
    known = {n: (units or {}).get(n, CHANNELS[n].unit) for n in log.channels if n in CHANNELS}
    sampled = [_sampled(log, name, known.get(name, "")) for name in log.channels]
    sampled = [s for s in sampled if s.rows.size >= _FEWEST_SAMPLES]
    together = _together(log, sampled)
    found = list(together)
    taken = np.zeros(log.time.size, dtype=bool)
    for fault in together:
        taken[fault.first : fault.stop] = True
    for channel in sampled:
        alone = list(_alone(channel, taken, log))
        found += alone or _stepped(channel, taken)
        found += _saturated(channel, taken)
    evaluated = {s.name for s in sampled}
    found += _clock_gaps(log)
    states = {n: _states(log[n], n, n in (*evaluated, "time"), found) for n in ("time", *log.channels)}
    return LogFlags(log.name, states, tuple(found))


def _states(values: Array, name: str, evaluated: bool, faults: list[Fault]) -> NDArray[np.uint8]:
    states = np.full(values.size, Flag.GOOD if evaluated else Flag.NOT_EVALUATED, dtype=np.uint8)
    for fault in faults:
        if fault.channel in (name, EVERY):
            part = states[fault.first : fault.stop]
            np.maximum(part, np.uint8(fault.state), out=part)
    states[np.isnan(values)] = Flag.MISSING
    return states


def _sampled(log: Log, name: str, unit: str) -> _Sampled:
    rows = np.flatnonzero(np.isfinite(log[name]))
    return _Sampled(name, rows, log.time[rows], log[name][rows], _moving(log)[rows], unit)


def _moving(log: Log) -> Mask:
    """Mask (n,) of samples at which any speed shows that the car moves; all if there is no speed."""
    known = [n for n in SPEEDS if n in log]
    if not known:
        return np.ones(log.time.size, dtype=bool)
    scale = {n: _RADIUS if n.startswith("wheel") else 1.0 for n in known}
    faster = [np.nan_to_num(np.abs(log[n]), nan=np.inf) * scale[n] > QUALITY.standing_speed for n in known]
    return np.asarray(np.any(faster, axis=0))


def _together(log: Log, sampled: list[_Sampled]) -> list[Fault]:
    """Segments in which all channels are frozen, or follow straight lines."""
    whole = [s for s in sampled if s.rows.size == log.time.size]
    if len(whole) < 2:
        return []
    moving = whole[0].moving
    rests = np.all([s.equal for s in whole], axis=0)
    frozen = improbable_segments(rests, moving, QUALITY.varying_rest_ratio, finer=[s.resting for s in whole])
    frozen = [(a, b) for a, b in _lasting(frozen, log.time) if any(s.breaks_off(a, b) for s in whole)]
    faults = [_every(log, a, b, "frozen", "all channels are constant") for a, b in frozen]
    lines = np.all([s.straight for s in whole], axis=0)
    for a, b in frozen:
        lines[max(a - 1, 0) : b + LINE] = False
    filled = improbable_segments(lines, moving, QUALITY.line_ratio, LINE, [s.bending for s in whole])
    filled = merged(filled, QUALITY.joined_gap)
    for a, b in _lasting(filled, log.time):
        if moving[a:b].any() and any(np.ptp(s.values[a:b]) > 0.0 and s.breaks_off(a, b) for s in whole):
            faults.append(_every(log, a, b, "straight_line", "all channels follow straight lines"))
    return faults


def _every(log: Log, first: int, stop: int, test: str, why: str) -> Fault:
    return Fault(EVERY, first, stop, test, f"{why} for {log.time[stop - 1] - log.time[first]:.3g} s")


def _lasting(found: Spans, time: Array) -> Spans:
    return [(a, b) for a, b in found if time[b - 1] - time[a] >= QUALITY.shortest_time]


def _alone(channel: _Sampled, taken: Mask, log: Log) -> Iterator[Fault]:
    """The faults of one channel outside of the faults of all channels (``taken``)."""
    rows, values = channel.rows, channel.values
    free = ~taken[rows]
    marked = ~free

    def fault(a: int, b: int, test: str, why: str) -> Fault:
        marked[a:b] = True
        return Fault(channel.name, int(rows[a]), int(rows[b - 1]) + 1, test, why)

    for a, b in _free(dropouts(values), free) if channel.varies else ():
        what = f"jumps to {channel.text(values[a])} and back"
        yield fault(a, b, "dropout" if b - a > 1 else "spike", what)
    if not channel.rests and np.ptp(values) > 0.0:
        for a, b, test, why in _regular(channel, marked):
            yield fault(a, b, test, why)
    if not (channel.rests or channel.varies):
        for a, b, test, why in _contradicted(channel, marked, log):
            yield fault(a, b, test, why)
    for i in spikes(values, channel.resolution):
        if not marked[max(i - 1, 0) : i + 2].any():
            size = values[i] - 0.5 * (values[i - 1] + values[i + 1])
            yield fault(
                int(i),
                int(i) + 1,
                "spike",
                f"differs from its neighbors by {channel.text(size, 3, step=True)} for one sample",
            )


def _contradicted(channel: _Sampled, marked: Mask, log: Log) -> Iterator[tuple[int, int, str, str]]:
    """Rests of a command that the car's motion, its own jumps or the quantization of its source contradict."""
    time, values = channel.time, channel.values
    rests = [
        (a - 1, b)
        for a, b in spans(channel.equal & channel.moving & ~marked)
        if b - a + 1 >= QUALITY.shortest_segment and time[b - 1] - time[a - 1] >= QUALITY.shortest_time
    ]
    off = off_source_grid(values, rests)
    if off is not None:
        between = channel.equal & off & ~marked
        found = improbable_segments(between, channel.moving & ~marked, QUALITY.varying_rest_ratio)
        for a, b in _lasting(found, time):
            what = f"is constant at {channel.text(values[a])} for {time[b - 1] - time[a]:.3g} s"
            yield a, b, "frozen", f"{what}, between the quantization steps at which it rests elsewhere"
    if channel.name in ("drive_torque", "motor_current", "drive_force") and rests:
        force, speed = (
            log[n][channel.rows] if n in log else np.full(values.size, np.nan) for n in ("acceleration", "speed")
        )
        tie = drive_tie(time, values, force, speed, channel.moving & ~marked)
        free = [(a, b) for a, b in rests if not marked[a:b].any()]
        yield from contradicted_rests(values, free, tie)


def _clock_gaps(log: Log) -> Iterator[Fault]:
    """The first sample after each gap or jump of the clock, which cannot be distinguished."""
    steps = np.diff(log.time)
    for i in clock_gaps(log.time):
        usual = float(np.median(steps))
        why = f"steps by {steps[i]:.3g} s, typically {usual:.3g} s"
        yield Fault("time", int(i) + 1, int(i) + 2, "clock_gap", why, Flag.SUSPECT)


def _saturated(channel: _Sampled, taken: Mask) -> Iterator[Fault]:
    """Peaks at the sensor's limit: only suspect, since a command may have reached its own limit."""
    values, rows = channel.values, channel.rows
    for a, b in saturated_spans(values):
        if not taken[rows[a:b]].any():
            why = f"stays at its extreme value, {channel.text(values[a])}"
            yield Fault(channel.name, int(rows[a]), int(rows[b - 1]) + 1, "saturated", why, Flag.SUSPECT)


def _stepped(channel: _Sampled, taken: Mask) -> Iterator[Fault]:
    """A speed or load after a permanent jump; the channel does not show which side of the jump is wrong.

    A change across a gap of the clock is no jump within one sample.
    """
    if channel.name not in (*SPEEDS, *_LOADS) or taken[channel.rows].any():
        return
    at, steps = level_step(channel.values), np.diff(channel.time)
    if at is not None and steps[at - 1] > (1.0 + QUALITY.longest_step) * float(np.median(steps)):
        return
    if at is not None and channel.moving[at - 1 : at + 1].all() and not _stop_or_start(channel, at):
        jump = channel.values[at] - channel.values[at - 1]
        why = f"jumps by {channel.text(jump, 3, step=True)} within one sample and stays: its gain or zero changed"
        yield Fault(channel.name, int(channel.rows[at]), int(channel.rows[-1]) + 1, "level_step", why, Flag.SUSPECT)


def _stop_or_start(channel: _Sampled, at: int) -> bool:
    """Whether the step of a speed to sample ``at`` is next to a standstill and no faster than tires allow.

    The step's duration counts from the first sample of the previous reading, which may be held.
    """
    if channel.name not in SPEEDS:
        return False
    values, time = channel.values, channel.time
    changes = np.flatnonzero(values[1:at] != values[: at - 1])
    lasted = float(time[at] - time[int(changes[-1]) + 1 if changes.size else 0])
    jump = abs(float(values[at] - values[at - 1]))
    about = np.abs(time - time[at]) <= _BESIDE * lasted
    rests = float(np.abs(values[about]).min()) <= _AT_REST * jump
    radius = _RADIUS if channel.name.startswith("wheel") else 1.0
    return rests and radius * jump <= QUALITY.hardest_stop * lasted


def _regular(channel: _Sampled, marked: Mask) -> Iterator[tuple[int, int, str, str]]:
    """Segments in which a channel is frozen or follows a straight line; ``marked`` samples are excluded."""
    time, values, moving = channel.time, channel.values, channel.moving
    longer = QUALITY.varying_rest_ratio if channel.varies else QUALITY.command_rest_ratio
    judged = moving & ~marked
    if not channel.varies:
        judged = judged & (np.abs(values) > QUALITY.idle_share * float(np.abs(values).max()))
    for a, b in _lasting(improbable_segments(channel.equal & ~marked, judged, longer), time):
        if not channel.varies and time[b - 1] - time[a] < QUALITY.command_time:
            continue
        if not marked[a:b].any() and channel.breaks_off(a, b) and (channel.varies or not _extreme(channel, a)):
            what = f"is constant at {channel.text(values[a])} for {time[b - 1] - time[a]:.3g} s"
            yield (
                a,
                b,
                "frozen",
                f"{what}, elsewhere for at most {_longest_rest(channel, judged & ~marked, a, b):.2g} s",
            )
    # A constant line is a frozen channel, or no fault.
    lines = (channel.straight if channel.varies else channel.straight & ~channel.still) & ~marked
    found = merged(
        improbable_segments(lines, moving & ~marked, QUALITY.line_ratio, LINE, [channel.bending]), QUALITY.joined_gap
    )
    for a, b in _lasting(found, time):
        if (
            not marked[a:b].any()
            and np.ptp(values[a:b]) > 0.0
            and channel.breaks_off(a, b)
            and _on_chord(channel, a, b)
            and rounded_line(channel.places(a, b), values[a:b], channel.resolution)
        ):
            yield a, b, "straight_line", f"follows a straight line for {time[b - 1] - time[a]:.3g} s"


def _longest_rest(channel: _Sampled, judged: Mask, first: int, stop: int) -> float:
    """Duration, s, of the longest rest of the judged samples outside of a segment."""
    other = channel.equal & judged
    other[first:stop] = False
    return max((float(channel.time[b - 1] - channel.time[max(a - 1, 0)]) for a, b in spans(other)), default=0.0)


def _on_chord(channel: _Sampled, a: int, b: int) -> bool:
    """Whether a segment lies on one chord, or on two that meet at a true value among interpolated ones.

    A steady or slowly changing reading of coarse resolution does, too: of a parabola with the rise R, a chord is up to
    R / 4 away and two are up to R / 16. So the segment must rise by more quanta than that allows, unless the channel
    is so noisy that it is never that smooth.
    """
    values = channel.values[a:b]
    rise = float(np.ptp(values)) / channel.resolution
    steady = 0.0 if channel.usual_bend > 4.0 * channel.resolution else 4.0
    for place in channel.places(a, b):
        off = np.abs(values - _chord(place, values))
        at = int(np.argmax(off))
        if rise > steady and _near(off, channel.resolution):
            return True
        if rise > 16.0 and 0 < at < off.size - 1:
            both = [
                np.abs(v - _chord(x, v)) for x, v in ((place[: at + 1], values[: at + 1]), (place[at:], values[at:]))
            ]
            if _near(np.concatenate(both), channel.resolution):
                return True
    return False


def _chord(place: Array, values: Array) -> Array:
    """The line between the first and the last of values (n,) at these places (n,)."""
    return np.asarray(values[0] + (place - place[0]) / (place[-1] - place[0]) * (values[-1] - values[0]))


def _near(off: Array, resolution: float) -> bool:
    """Whether a segment's distances (n,) from its line are those of rounding; its ends may lie beside the line."""
    return bool(np.mean(off <= resolution) >= 1.0 - QUALITY.line_bends)


def _extreme(channel: _Sampled, at: int) -> bool:
    return channel.values[at] in (channel.values.min(), channel.values.max())


def _free(found: Spans, free: Mask) -> Spans:
    return [(a, b) for a, b in found if free[a:b].all()]
