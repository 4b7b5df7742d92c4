"""Selection of the logs of a folder that are runs of one description, with reasons for the others."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from vdyn_cli.io.channel_survey import ChannelFacts, survey
from vdyn_cli.io.clocks.sample_times import COARSEST
from vdyn_cli.project.drafting.channel_guess import ChannelGuess, Words, without_unit
from vdyn_cli.project.drafting.driven_falls import SpeedFall, speed_falls

_LEAST_RECORDED = 0.5  # of a log, in which a needed channel has values: less is refused when it is read
_RUN_IN = 5.0  # s before a coast-down that belong to its run
_ALIKE = 0.15  # relative difference of mean decelerations of coast-downs from one speed, by slope and wind
_LEAST_FALL = 10.0  # s, or half of the log, for which the speed of a log with a coast-down decreases without a break


@dataclass(frozen=True)
class GuessedLog:
    """A log, or the part of one of its coast-downs, with facts on its columns and a guess for each channel.

    ``name``: of the file, with the folders that distinguish it. ``window``: the keys of a run that select that part of
    the log, as text. ``recording``: its number in a file of several, counted from 1. ``driven``: why the part is not a
    coast-down; empty if nothing shows it. ``deceleration``: mean of the part, m/s^2; NaN if unknown.
    """

    path: Path
    facts: tuple[ChannelFacts, ...]
    guesses: Mapping[str, ChannelGuess]
    name: str
    window: str = ""
    recording: int = 1
    driven: str = ""
    deceleration: float = math.nan

    def decided_columns(self) -> dict[str, tuple[tuple[Words, str], str]]:
        """Column, without its unit, and group of each decided channel."""
        return {channel: (without_unit(column), group) for channel, (column, group) in self.columns().items()}

    def agrees(self, other: GuessedLog, channel: str) -> bool:
        """Whether one description can map ``channel`` in both logs.

        Logs of one logger with two clocks agree in their time: where one clock restarts, the run names the other.
        """
        own, others = (log.decided_columns().get(channel) for log in (self, other))
        one_logger = [f.column for f in self.facts] == [f.column for f in other.facts]
        return own == others or (channel == "time" and one_logger and None not in (own, others))

    def differing(self, other: GuessedLog, channels: Collection[str]) -> dict[str, str]:
        """The text of the keys of a run for ``channels`` whose columns have another name, unit or sign in ``other``."""
        own, others = self.guesses, other.guesses
        there = [c for c in channels if own[c].facts is not None and others[c].facts is not None]
        columns = [f'{c}: "{own[c].column}"' for c in there if own[c].column != others[c].column]
        units = [f'{c}: "{own[c].unit}"' for c in there if own[c].unit not in ("?", others[c].unit)]
        signs = [f"{c}: -1" for c in there if own[c].sign != others[c].sign]
        keys = (("columns", columns), ("units", units), ("signs", signs))
        return {key: f"{{{', '.join(found)}}}" for key, found in keys if found}

    def columns(self) -> dict[str, tuple[str, str]]:
        """Column and group of each decided channel."""
        return {
            channel: (guess.facts.column, guess.facts.info.group)
            for channel, guess in self.guesses.items()
            if guess.facts is not None
        }


def split_coast_downs(log: GuessedLog, falling: str, drive: Collection[str]) -> list[GuessedLog]:
    """The parts of a log with several coast-downs, each from 5 s before it; else the log alone.

    A coast-down is a decrease of the speed of at least 10 s without a break, and of half the longest one that repeats.
    Those that a signal of the driver shows as driven are parts, too, with the reason why they are left out.

    Parameters
    ----------
    falling : the channel that decreases in a coast-down; empty: the log is not split.
    drive : channels that drive the car; a log with one of them is not split.
    """
    facts = log.guesses[falling].facts if falling else None
    if facts is None or set(drive) & set(log.columns()):
        return [log]
    spans = [fall for fall in facts.falls if fall[1] - fall[0] >= _LEAST_FALL]
    if len(spans) < 2:
        return [log]
    falls = speed_falls(log.path, log.recording, (facts, log.guesses[falling].unit), spans)
    free = [fall for fall in falls if not fall.driven]
    if not free:
        return [replace(log, driven=f"each of {len(falls)} decreases of the speed was driven: {falls[0].driven}")]
    longest = max(fall.length for fall in _repeated(free) or free)
    if sum(fall.length >= 0.5 * longest for fall in free) < 2 and len(free) == len(falls):
        return [log]
    parts, last = [], facts.info.span[0]
    for fall in (fall for fall in falls if fall.length >= 0.5 * longest):
        begin, last = max(fall.start - _RUN_IN, last), fall.stop
        keys = f"{log.window}, from_time: {begin:.1f} s, to_time: {fall.stop:.1f} s"
        own = survey(log.path, (begin, fall.stop), log.recording)
        parts.append(replace(log, facts=own, window=keys, driven=fall.driven, deceleration=fall.deceleration))
    return parts


def _repeated(falls: Sequence[SpeedFall]) -> list[SpeedFall]:
    """The falls with the mean deceleration of another one: a car that coasts repeats it, a driver does not.

    Those shorter than a quarter of the longest are brakings, which are alike, too.
    """
    least = 0.25 * max(fall.length for fall in falls)
    falls = [fall for fall in falls if fall.length >= least]
    pace = [fall.deceleration for fall in falls]
    near = [sum(abs(one - other) <= _ALIKE * one for other in pace) > 1 for one in pace]
    return [fall for fall, more in zip(falls, near, strict=True) if more]


def split_recordings(log: GuessedLog) -> list[GuessedLog]:
    """The recordings of a file whose clock restarts with each of them; else the log alone."""
    clock = log.guesses["time"].facts
    count = len(clock.info.recordings) if clock is not None else 0
    return [_recording(log, k + 1) for k in range(count)] or [log]


def _recording(log: GuessedLog, number: int) -> GuessedLog:
    """One recording of a file, with the guesses of the first one where its columns have values."""
    facts = log.facts if number == 1 else survey(log.path, recording=number)
    there = {(f.column, f.info.group): f for f in facts if f.state != "empty"}
    guesses = {
        channel: guess if guess.facts is None else replace(guess, facts=there.get(_at(guess.facts)))
        for channel, guess in log.guesses.items()
    }
    return replace(log, facts=facts, guesses=guesses, window=f", recording: {number}", recording=number)


def _at(facts: ChannelFacts) -> tuple[str, str]:
    return facts.column, facts.info.group


def reference_log(logs: Sequence[GuessedLog], needed: Collection[str]) -> GuessedLog:
    """The log with which the others are compared: of those with most needed channels, one of the most frequent kind.

    Of that kind, it is one with most other channels: a log in which one is constant, such as that of a car at rest,
    does not hide it in the others.
    """
    keys = [_key(log, needed) for log in logs]
    alike = Counter(keys)
    return max(
        zip(logs, keys, strict=True), key=lambda one: (len(one[1]), alike[one[1]], len(one[0].decided_columns()))
    )[0]


def why_left_out(
    logs: Sequence[GuessedLog], usual: GuessedLog, needed: Collection[str], falling: str, drive: Collection[str]
) -> list[str]:
    """For each log why it is not a run like the usual one; empty if it is.

    Parameters
    ----------
    needed : channels that must be the same columns in all runs.
    falling : the channel that must decrease in a run; empty: none. drive : channels that drive the car; if all logs
        have one, ``falling`` is not required.

    A test that leaves out every log is not applied: the draft then lists them, and the user decides.
    """
    unlike = [_unlike(log, usual, needed) for log in logs]
    reasons = [why or _doubtful(log, logs[:k], needed) for k, (log, why) in enumerate(zip(logs, unlike, strict=True))]
    reasons = unlike if all(reasons) else reasons
    kept = [log for log, why in zip(logs, reasons, strict=True) if not why]
    if not falling or all(set(drive) & set(log.columns()) for log in kept):
        return reasons
    falls = [why or _not_a_coast(log, falling) for log, why in zip(logs, reasons, strict=True)]
    return falls if not all(falls) else reasons


def without_coast_down(logs: Sequence[GuessedLog], falling: str, drive: Collection[str]) -> list[str]:
    """A comment for a draft in none of whose logs the falling channel decreases; empty if one does, or may not."""
    if not falling or not logs or all(set(drive) & set(log.columns()) for log in logs):
        return []
    if driven := [f"  # {log.name}: {_not_a_coast(log, falling)}" for log in logs if log.driven]:
        return driven
    found = [(_no_coast(facts), facts) for log in logs if (facts := log.guesses[falling].facts) is not None]
    if len(found) < len(logs) or not all(why for why, _ in found):
        return []
    return [
        f"  # {falling}: '{found[0][1].column}' decreases for {_LEAST_FALL:g} s in none of the logs: no coast-downs?"
    ]


def _key(log: GuessedLog, needed: Collection[str]) -> tuple[tuple[str, tuple[tuple[Words, str], str]], ...]:
    return tuple((n, at) for n, at in log.decided_columns().items() if n in needed)


def _unlike(log: GuessedLog, usual: GuessedLog, needed: Collection[str]) -> str:
    own, others = dict(_key(log, needed)), dict(_key(usual, needed))
    lacking = [f"no {n}: {log.guesses[n].why}" for n in others if n not in own]
    if lacking:
        return "; ".join(lacking)
    differs = ", ".join(n for n in own if not log.agrees(usual, n))
    return f"other columns than {usual.name} ({differs}): describe such logs in a separate file" if differs else ""


def _doubtful(log: GuessedLog, before: Sequence[GuessedLog], needed: Collection[str]) -> str:
    """Why a log is not used as it is: a clock in a wrong unit, a channel recorded in less than half of it, a copy."""
    clock = log.guesses["time"].facts
    (first, last), rate = (clock.info.span, clock.info.rate) if clock is not None else ((0.0, 0.0), math.inf)
    if clock is not None and rate < 1.0 / COARSEST:
        unit = clock.info.unit or "s"
        return f"a sample every {1.0 / rate:.0f} s: its time is not in {unit}; if it is in ms, add units: {{time: ms}}"
    for name in sorted({*needed} & log.columns().keys() - {"time"}):
        one = next(f for f in log.facts if (f.column, f.info.group) == log.columns()[name])
        start, stop = one.info.span
        if "from_time" not in log.window and stop - start < _LEAST_RECORDED * (last - first):
            return (
                f"{name} is recorded from {start:.4g} to {stop:.4g} s only: add from_time and to_time to use that part"
            )
    same = next((other for other in before if _is_copy(log, other)), None)
    return f"the same recording as {same.name}{same.window}" if same else ""


def _is_copy(log: GuessedLog, other: GuessedLog) -> bool:
    """Whether all varying channels of one of the logs are also in the other."""
    own, others = _values(log), _values(other)
    return bool(own) and bool(others) and (own <= others or own >= others)


def _values(log: GuessedLog) -> frozenset[tuple[float, ...]]:
    """Times, extremes, ends and a mean of each varying channel, to six digits: those of a copy are equal."""
    varying = [f for f in log.facts if f.state == "varies"]
    every = [(*f.info.span, f.lowest, f.highest, *f.ends, f.angle.real, f.angle.imag) for f in varying]
    return frozenset(tuple(float(f"{x:.6g}") for x in one) for one in every)


def are_drives(logs: Sequence[GuessedLog], falling: str, drive: Collection[str], mapped: Collection[str]) -> bool:
    """Whether a channel that drives the car is mapped, and a log is not mainly one fall of the speed."""
    if not set(drive) & set(mapped):
        return False
    speeds = (log.guesses[falling].facts for log in logs)
    return any(s is not None and s.longest_fall < 0.5 * (s.info.span[1] - s.info.span[0]) for s in speeds)


def _not_a_coast(log: GuessedLog, falling: str) -> str:
    return f"not a coast-down: {log.driven}" if log.driven else _no_coast(log.guesses[falling].facts)


def _no_coast(facts: ChannelFacts | None) -> str:
    if facts is None or math.isnan(facts.info.rate):  # without a clock
        return ""
    fall, length = facts.longest_fall, facts.info.span[1] - facts.info.span[0]
    if not fall < min(_LEAST_FALL, 0.5 * length):
        return ""
    return f"not a coast-down: the speed decreases for at most {fall:.0f} s of {length:.0f} s without a break"
