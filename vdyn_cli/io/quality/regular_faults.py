"""Faults by which readings are too regular: constant, on straight lines, or rests that other channels contradict."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import erf

import numpy as np

from vdyn_cli.io.quality.command_rests import contradicted_rests, drive_tie, off_source_grid
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.io.quality.regular_segments import LINE, improbable_segments, merged, rounded_line
from vdyn_cli.io.quality.sampled_channel import SampledChannel, jumps, lasting
from vdyn_cli.quantities.arrays import Array, Mask, spans
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quality_flags import EVERY, Fault

Found = Iterator[tuple[int, int, str, str]]  # first sample, stop, test, reason


def all_channels_faults(log: Log, sampled: Sequence[SampledChannel]) -> list[Fault]:
    """Segments in which all channels are frozen, or follow straight lines."""
    whole = [s for s in sampled if s.rows.size == log.time.size]
    if len(whole) < 2:
        return []
    moving = whole[0].moving
    rests = np.all([s.equal for s in whole], axis=0)
    frozen = improbable_segments(rests, moving, QUALITY.varying_rest_ratio, finer=[s.resting for s in whole])
    frozen = [(a, b) for a, b in lasting(frozen, log.time) if any(s.breaks_off(a, b) for s in whole)]
    faults = [_every(log, a, b, "frozen", "all channels are constant") for a, b in frozen]
    lines = np.all([s.straight for s in whole], axis=0)
    for a, b in frozen:
        lines[max(a - 1, 0) : b + LINE] = False
    filled = improbable_segments(lines, moving, QUALITY.line_ratio, LINE, [s.bending for s in whole])
    filled = merged(filled, QUALITY.joined_gap)
    for a, b in lasting(filled, log.time):
        if moving[a:b].any() and any(np.ptp(s.values[a:b]) > 0.0 and s.breaks_off(a, b) for s in whole):
            faults.append(_every(log, a, b, "straight_line", "all channels follow straight lines"))
    return faults


def _every(log: Log, first: int, stop: int, test: str, why: str) -> Fault:
    return Fault(EVERY, first, stop, test, f"{why} for {log.time[stop - 1] - log.time[first]:.3g} s")


def contradicted_command(channel: SampledChannel, marked: Mask, log: Log) -> Found:
    """Rests of a command that the car's motion, its jumps or the quantization of its source contradict; mask (n,)."""
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
        for a, b in lasting(found, time):
            what = f"is constant at {channel.text(values[a])} for {time[b - 1] - time[a]:.3g} s"
            yield a, b, "frozen", f"{what}, between the quantization steps at which it rests elsewhere"
    if channel.name in ("drive_torque", "motor_current", "drive_force") and rests:
        force, speed = (
            log[n][channel.rows] if n in log else np.full(values.size, np.nan) for n in ("acceleration", "speed")
        )
        tie = drive_tie(time, values, force, speed, channel.moving & ~marked)
        free = [(a, b) for a, b in rests if not marked[a:b].any()]
        yield from contradicted_rests(values, free, tie)


def regular_faults(channel: SampledChannel, marked: Mask) -> Found:
    """Segments in which a channel is frozen or follows a straight line; ``marked`` (n,) samples are excluded."""
    time, values, moving = channel.time, channel.values, channel.moving
    longer = QUALITY.varying_rest_ratio if channel.varies else QUALITY.command_rest_ratio
    judged = moving & ~marked
    if not channel.varies:
        judged = judged & (np.abs(values) > QUALITY.idle_share * float(np.abs(values).max()))
    for a, b in lasting(improbable_segments(channel.equal & ~marked, judged, longer), time):
        if not (_exceeds_noise(channel, a, b) if channel.varies else time[b - 1] - time[a] >= QUALITY.command_time):
            continue
        if not marked[a:b].any() and channel.breaks_off(a, b) and (channel.varies or not _extreme(channel, a)):
            what = f"is constant at {channel.text(values[a])} for {time[b - 1] - time[a]:.3g} s"
            yield (
                a,
                b,
                "frozen",
                f"{what}, elsewhere for at most {longest_rest(channel, judged & ~marked, a, b):.2g} s",
            )
    # A constant line is a frozen channel, or no fault.
    lines = (channel.straight if channel.varies else channel.straight & ~channel.still) & ~marked
    found = merged(
        improbable_segments(lines, moving & ~marked, QUALITY.line_ratio, LINE, [channel.bending]), QUALITY.joined_gap
    )
    for a, b in lasting(found, time):
        if (
            not marked[a:b].any()
            and np.ptp(values[a:b]) > 0.0
            and channel.breaks_off(a, b)
            and _on_chord(channel, a, b)
            and rounded_line(channel.places(a, b), values[a:b], channel.resolution)
        ):
            yield a, b, "straight_line", f"follows a straight line for {time[b - 1] - time[a]:.3g} s"


def _exceeds_noise(channel: SampledChannel, a: int, b: int) -> bool:
    """Whether a constant segment ends with a jump, or is too long for the channel's noise at a constant true value."""
    rests = int(np.count_nonzero(channel.equal[1:] & ~channel.equal[:-1]))
    likely = (b - a - 2) * np.log(_likeliest_rest(channel))
    return jumps(channel, b) or bool(likely < np.log(QUALITY.false_alarm / max(rests, 1)))


def _likeliest_rest(channel: SampledChannel) -> float:
    """Probability that a reading repeats halfway between two rounding limits, where the noise is least visible.

    With white noise of standard deviation s and steps q it is erf(q / (2 sqrt(2) s)); the mean square of
    x_k - 2 x_k-1 + x_k-2 is 6 (s^2 + q^2 / 12).
    """
    bends, step = np.diff(channel.values, 2)[channel.moving[2:]], channel.resolution
    bends = bends[np.abs(bends) <= QUALITY.exit_jump * channel.usual_step]  # without the jumps of faults
    noise = float(np.mean(bends**2)) / 6.0 - step**2 / 12.0 if bends.size else 0.0
    return max(erf(step / (8.0 * noise) ** 0.5), 1e-300) if noise > 0.0 else 1.0


def longest_rest(channel: SampledChannel, judged: Mask, first: int, stop: int) -> float:
    """Duration, s, of the longest rest of the judged samples outside of a segment."""
    other = channel.equal & judged
    other[first:stop] = False
    return max((float(channel.time[b - 1] - channel.time[max(a - 1, 0)]) for a, b in spans(other)), default=0.0)


def _on_chord(channel: SampledChannel, a: int, b: int) -> bool:
    """Whether a segment lies on one chord, or on two that meet at a true value among interpolated ones.

    A steady or slowly changing reading of coarse resolution does, too: of a parabola with the rise R, a chord is up to
    R / 4 away and two are up to R / 16. So the segment must rise by more quanta than that allows, unless the channel
    is so noisy that it is never that smooth.
    """
    values = channel.values[a:b]
    rise = float(np.ptp(values)) / channel.resolution
    steady = 0.0 if channel.usual_bend > QUALITY.chord_rise * channel.resolution else QUALITY.chord_rise
    for place in channel.places(a, b):
        off = np.abs(values - _chord(place, values))
        at = int(np.argmax(off))
        if rise > steady and _near(off, channel.resolution):
            return True
        if rise > QUALITY.two_chords_rise and 0 < at < off.size - 1:
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


def _extreme(channel: SampledChannel, at: int) -> bool:
    return channel.values[at] in (channel.values.min(), channel.values.max())
