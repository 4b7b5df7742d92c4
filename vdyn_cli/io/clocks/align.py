"""Put several loggers on one clock: resample the channels of the others to the reference's clock, and report it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.io.clocks.clock_estimate import clock_difference, stated_difference
from vdyn_cli.io.clocks.clock_policy import CLOCKS
from vdyn_cli.io.clocks.coarse_delay import STATE_DELAY
from vdyn_cli.io.clocks.sampled_signal import Signal
from vdyn_cli.io.clocks.tied_channels import ChannelTie, related_channels, tie_of, ties
from vdyn_cli.io.clocks.written_times import time_between
from vdyn_cli.io.quality.log_flags import flags
from vdyn_cli.io.quality.sampled_channel import SPEEDS
from vdyn_cli.quantities.arrays import Array, Mask
from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log, Samples
from vdyn_cli.quantities.quality_flags import Flag
from vdyn_cli.quantities.quantity import Given

AlignOn = str | tuple[str, str] | None
"""A channel that both loggers recorded, or the reference's channel and the other's; None: chosen automatically."""

LINES = "linear interpolation"  # how a slower logger's channel is resampled
MEANS = "means"  # likewise, a faster one's


def merge(
    reference: Log, others: Sequence[Log], align_on: AlignOn = None, delays: Sequence[Given | None] = ()
) -> tuple[Log, tuple[ClockDifference, ...]]:
    """Resample other loggers' channels to the reference's clock; report each delay, drift and resampling.

    Parameters
    ----------
    reference : defines the clock; all its channels are kept.
    others : each adds the channels that no earlier log has. Times of day of both loggers are compared as such.
    align_on : channels that determine the delay; None: the pair with the smallest standard error of the delay.
    delays : known delay of each other logger, s; None where it is estimated. Empty: all are estimated.

    Returns
    -------
    log : channels of a faster logger are averaged over the reference's median step, those of a slower one are
        interpolated linearly, and ``log.samples`` keeps their samples; NaN beyond its ends and in its gaps.
    clocks : one clock difference for each other logger.

    Raises
    ------
    InputError : a delay cannot be estimated.
    """
    merged = replace(reference, findings=(*reference.findings, *(f for log in others for f in log.findings)))
    step = float(np.median(np.diff(reference.time)))
    clocks = []
    for own, delay in zip(others, delays or [None] * len(others), strict=True):
        other = _from_one_origin(reference, own, delay is not None)
        found, differing = _clock(reference, other, align_on, delay)
        added, how = {}, {}
        at = found.stamp(reference.time)
        for channel in other.channels:
            if channel not in merged:
                added[channel], how[channel] = _resampled(other, channel, at, step)
        read, means = (_on_reference(kept, at, reference.time) for kept in _recorded(other, how))
        merged = merged.with_channels(**added)
        std = {} if found.stated else dict.fromkeys(added, found.run_delay_std(reference.time))
        merged = replace(merged, samples={**merged.samples, **read}, averaged={**merged.averaged, **means})
        merged = replace(merged, clock_std={**merged.clock_std, **std})
        found = found.model_copy(update={"channels": tuple(added)})
        merged = replace(merged, findings=(*merged.findings, *_clock_findings(found, how), *differing))
        clocks.append(found)
    return merged, tuple(clocks)


def _from_one_origin(reference: Log, other: Log, stated: bool) -> Log:
    """The other log with its times counted from the origin of the reference's, if both are times of day.

    Without a stated delay, logs that then do not overlap keep their own: their clocks are of different zones, or wrong.
    """
    if not np.isfinite(reference.begin + other.begin):
        return other
    time = other.time + time_between(reference.begin, other.begin)
    together = min(reference.time[-1], time[-1]) - max(reference.time[0], time[0])
    if not stated and together < CLOCKS.least_overlap * min(reference.duration, other.duration):
        return other
    shift = time[0] - other.time[0]
    samples = {n: (at + shift, values) for n, (at, values) in other.samples.items()}
    return replace(other, time=time, samples=samples, begin=reference.begin)


def _clock(reference: Log, other: Log, align_on: AlignOn, delay: Given | None) -> tuple[ClockDifference, list[Finding]]:
    """The difference of two clocks, and a warning for the pair of channels that contradicts it most."""
    possible = _possible(reference, other, align_on) if delay is None else ties(reference.channels, other.channels)
    sound, also = (_sound(log, possible) for log in (reference, other))
    found, problems = list[tuple[ChannelTie, ClockDifference]](), list[Finding]()
    for tie in possible:
        try:
            found.append((tie, clock_difference(sound, also, tie)))
        except InputError as error:
            problems += error.findings
    if delay is not None:
        best, by = stated_difference(reference, other, delay), "stated"
    elif found:
        best_tie, best = min(found, key=lambda one: one[1].delay_std)
        by = f"from {best_tie}"
    else:
        raise InputError(*problems)
    doubts = []
    for tie, one in found:
        apart = one.delay - float(best.stamp(np.array([one.at]))[0] - one.at)
        std = float(np.hypot(one.delay_std, best.delay_std))
        if one is not best and abs(apart) > CLOCKS.pairs_apart * std:
            what = f"the delay from some channels differs by up to {abs(apart):.4f} s +- {std:.4f} s "
            what += f"from {'the stated one' if best.stated else 'that of others'}: a sensor lags behind its own logger"
            got = f"{one.delay:+.4f} s from {tie}, {best.delay:+.4f} s {by}"
            remedy = "check the stated 'delay'" if best.stated else "select the pair to use with 'align_on'"
            remedy += ", and see the sensors' data sheets for their delay"
            doubts.append((abs(apart), Finding(other.name, what, got, remedy, doubt=True)))
    return best, [max(doubts, key=lambda d: d[0])[1]] if doubts else []


def _sound(log: Log, pairs: Sequence[ChannelTie]) -> Log:
    """The channels of the pairs, and the speeds that show whether the car moves, without samples that failed a test.

    A frozen segment would otherwise be matched to a motion that only the other logger recorded.
    """
    used = {n for pair in pairs for n in (pair.first, pair.second)} | set(SPEEDS)
    part = replace(log, channels={n: v for n, v in log.channels.items() if n in used})
    states = flags(part).states
    return part.with_channels(**{n: np.where(states[n] == Flag.FAILED, np.nan, part[n]) for n in part.channels})


def _possible(reference: Log, other: Log, align_on: AlignOn) -> list[ChannelTie]:
    """The pairs of channels that can align the clocks.

    Raises
    ------
    InputError : there are none.
    """
    if isinstance(align_on, str):
        lacking = [log for log in (reference, other) if align_on not in log]
        if len(lacking) == 1:
            raise InputError(_one_name(reference, other, align_on, lacking[0]))
        return [ChannelTie(align_on, align_on)]
    if align_on is not None:
        tie = tie_of(*align_on)
        if tie is None:
            what = f"'{align_on[0]}' and '{align_on[1]}' are not physically related, so they cannot align the clocks"
            ways = ", ".join(related_channels((align_on[0],))) or "none"
            raise InputError(Finding(other.name, what, "", f"channels related to '{align_on[0]}': {ways}"))
        return [tie]
    found = ties(reference.channels, other.channels)
    if not found:
        what = f"cannot be aligned with {reference.name}: they have no channel in common and no physically related pair"
        got = f"{_listed(other)}; of {reference.name}: {_listed(reference)}"
        choices = ((other, related_channels(reference.channels)), (reference, related_channels(other.channels)))
        serving = [f"map one of these from {log.name}: {', '.join(names)}" for log, names in choices if names]
        remedy = "; or ".join(serving) or "map a channel that both recorded"
        raise InputError(Finding(other.name, what, got, f"{remedy}; or {STATE_DELAY}"))
    return found


def _listed(log: Log) -> str:
    return ", ".join(log.channels) or "only the time"


def _one_name(reference: Log, other: Log, name: str, lacking: Log) -> Finding:
    """The finding that one of two loggers lacks the channel to align on; the remedy names a usable pair."""
    sides = [(name,) if name in log else tuple(log.channels) for log in (reference, other)]
    pair = next(iter(ties(*sides)), None)
    remedy = "map it for every logger"
    if pair is not None:
        of_first = f"'{pair.first}' of the first logger and '{pair.second}' of the other"
        remedy += f", or write 'align_on: [{pair.first}, {pair.second}]' to align on {of_first}"
    else:
        remedy += ", or name a channel of both with 'align_on'"
    return Finding(lacking.name, f"has no channel '{name}' to align the loggers on", remedy=remedy)


def on_one_clock(reference: Log, others: Sequence[Log]) -> Log:
    """Resample channels of one file that have other clocks to the reference's clock; report how each was resampled.

    Parameters
    ----------
    reference : defines the clock.
    others : logs whose time has the same origin, so that no delay is estimated.

    Returns
    -------
    Log : channels resampled as by `merge`; channels with the same sampling times are copied.
    """
    added: dict[str, Array] = {}
    how: dict[str, str] = {}
    samples: dict[str, Samples] = {}
    averaged: dict[str, Samples] = {}
    findings = list(reference.findings)
    step = float(np.median(np.diff(reference.time))) if reference.time.size > 1 else 0.0
    for other in others:
        findings += other.findings
        same = np.array_equal(other.time, reference.time)
        gaps = None if same or other.time.size < 2 else Signal(other.time, other.time).gaps_at(reference.time)
        for channel in other.channels:
            added[channel], words = (
                (other[channel], "") if same else _resampled(other, channel, reference.time, step, gaps)
            )
            if words:
                how[channel] = words
        read, means = _recorded(other, how)
        samples |= read
        averaged |= means
    for words in dict.fromkeys(how.values()):
        names = ", ".join(f"'{name}'" for name, kind in how.items() if kind == words)
        first = next(iter(reference.channels), "time")
        what = f"resampled to the sampling times of '{first}': {names} ({words})"
        remedy = "choose the clock of another group with the key 'group' of the channel 'time'"
        findings.append(Finding(reference.name, what, remedy=remedy))
    return replace(reference.with_channels(**added), findings=tuple(findings), samples=samples, averaged=averaged)


def _resampled(log: Log, channel: str, at: Array, step: float, gaps: Mask | None = None) -> tuple[Array, str]:
    """A channel at other times, and the method; ``gaps`` (n,): the times in gaps or beyond the ends of its clock."""
    signal = Signal(*_samples_of(log, channel))
    if signal.time.size < 2:
        return np.full(at.size, np.nan), "fewer than two values"
    whole = signal.time.size == log.time.size and channel not in log.samples
    if signal.step < 0.75 * step:
        return signal.averages(at, step), f"{MEANS} over {step:.4g} s"
    values = np.interp(at, signal.time, signal.values)
    values[gaps if whole and gaps is not None else signal.gaps_at(at)] = np.nan
    return values, LINES


def _samples_of(log: Log, channel: str) -> Samples:
    """Times and values of a channel's recorded samples."""
    if channel in log.samples:
        return log.samples[channel]
    written = np.isfinite(log[channel])
    return (log.time, log[channel]) if written.all() else (log.time[written], log[channel][written])


def _recorded(log: Log, how: Mapping[str, str]) -> tuple[dict[str, Samples], dict[str, Samples]]:
    """The samples, on the log's own clock, of its linearly interpolated channels, and of its averaged ones."""
    lines, means = ([n for n in log.channels if how.get(n, "").startswith(kind)] for kind in (LINES, MEANS))
    return {n: _samples_of(log, n) for n in lines}, {n: _samples_of(log, n) for n in means}


def _on_reference(samples: Mapping[str, Samples], at: Array, time: Array) -> dict[str, Samples]:
    """Samples with their times converted to the reference's clock.

    ``time`` (n,) on the reference's clock is ``at`` (n,) on theirs; the relation is linear.
    """
    rate = (time[-1] - time[0]) / (at[-1] - at[0])
    return {n: (time[0] + rate * (own - at[0]), values) for n, (own, values) in samples.items()}


def _estimated(found: ClockDifference, drift: str) -> str:
    """Text of the drift, and of the channels that aligned a clock."""
    first, second = found.pair
    corrected = "corrected" if found.corrected else "not significant and not corrected"
    same = f"channel '{first}', which here is {found.gain:.4g} x {found.run} {found.offset:+.3g}"
    by = same if first == second else f"'{first}' and '{second}'"
    return f" at {found.at:.4g} s, and drifts by {drift}, which is {corrected}; estimated from {by}"


def _clock_findings(found: ClockDifference, how: dict[str, str]) -> list[Finding]:
    """A note of how a logger's clock was aligned, and a warning where it drifts more than a quartz clock."""
    drift = f"{1e6 * found.drift:+z.0f} ppm +- {1e6 * found.drift_std:.0f} ppm"
    what = f"clock is {found.delay:+.4f} s +- {found.delay_std:.4f} s (standard error) from that of {found.run}"
    what += ", as stated" if found.stated else _estimated(found, drift)
    for words in dict.fromkeys(how.values()):
        names = ", ".join(f"'{name}'" for name, kind in how.items() if kind == words)
        what += f"; {names} resampled to its clock ({words})"
    findings = [Finding(found.logger, what)]
    if found.corrected and abs(found.drift) > CLOCKS.prior_contradicted * CLOCKS.prior_drift:
        what = f"clock drifts by {drift}: more than any quartz clock"
        remedy = "check the unit and the sampling rate of its time, and whether it lost samples"
        findings.append(Finding(found.logger, what, remedy=remedy, doubt=True))
    return findings
