"""Which logs of a folder are runs of one description, and why the others are not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from vdyn_cli.io.channel_survey import ChannelFacts, survey
from vdyn_cli.project.channel_guess import ChannelGuess, Words, without_unit

_RUN_IN = 5.0  # s before a coast-down that its run holds
_LEAST_FALL = 10.0  # s at a time, or half of the log, that the speed of a log with a coast-down falls


@dataclass(frozen=True)
class GuessedLog:
    """A log, or the part of one coast-down of several, what it holds, and which column could be which channel.

    ``window``: the keys of a run that take that part of the log, as text.
    """

    path: Path
    facts: tuple[ChannelFacts, ...]
    guesses: Mapping[str, ChannelGuess]
    window: str = ""

    def meanings(self) -> dict[str, tuple[tuple[Words, str], str]]:
        """Column, whatever its unit, and group of each channel that is decided."""
        return {channel: (without_unit(column), group) for channel, (column, group) in self.columns().items()}

    def differing(self, other: GuessedLog, channels: Collection[str]) -> str:
        """The keys of a run, as text, that read channels whose columns the other log has by other names or units."""
        own, others = self.guesses, other.guesses
        there = [c for c in channels if own[c].facts is not None and others[c].facts is not None]
        columns = [f'{c}: "{own[c].column}"' for c in there if own[c].column != others[c].column]
        units = [f'{c}: "{own[c].unit}"' for c in there if own[c].unit not in ("?", others[c].unit)]
        keys = (("columns", columns), ("units", units))
        return "".join(f", {key}: {{{', '.join(found)}}}" for key, found in keys if found)

    def columns(self) -> dict[str, tuple[str, str]]:
        """Column and group of each channel that is decided."""
        return {
            channel: (guess.facts.column, guess.facts.info.group)
            for channel, guess in self.guesses.items()
            if guess.facts is not None
        }


def single_coasts(log: GuessedLog, falling: str, drive: Collection[str]) -> list[GuessedLog]:
    """The parts of a log with several coast-downs, each with the seconds before it; else the log.

    Parameters
    ----------
    falling, drive : as in ``why_left_out``.
    """
    facts = log.guesses[falling].facts if falling else None
    if facts is None or set(drive) & set(log.columns()):
        return [log]
    falls = [fall for fall in facts.falls if fall[1] - fall[0] >= _LEAST_FALL]
    longest = max((stop - start for start, stop in falls), default=0.0)
    coasts = [(start, stop) for start, stop in falls if stop - start >= 0.5 * longest]
    if len(coasts) < 2:
        return [log]
    parts, last = [], facts.info.span[0]
    for start, stop in coasts:
        begin, last = max(start - _RUN_IN, last), stop
        keys = f", from_time: {begin:.1f} s, to_time: {stop:.1f} s"
        parts.append(GuessedLog(log.path, survey(log.path, (begin, stop)), log.guesses, keys))
    return parts


def usual_log(logs: Sequence[GuessedLog], needed: Collection[str]) -> GuessedLog:
    """The log that the others are compared with: of those with most of the needed channels, one that most are like."""
    keys = [_key(log, needed) for log in logs]
    alike = Counter(keys)
    return max(zip(logs, keys, strict=True), key=lambda one: (len(one[1]), alike[one[1]]))[0]


def why_left_out(
    logs: Sequence[GuessedLog], usual: GuessedLog, needed: Collection[str], falling: str, drive: Collection[str]
) -> list[str]:
    """Why a log is no run beside the usual one; empty where it is.

    Parameters
    ----------
    needed : channels that must be the same columns in all runs.
    falling : the channel that falls in a run; empty where none must. drive : channels that drive the car: where all
        logs have one, none needs to fall.
    """
    reasons = [_unlike(log, usual, needed) for log in logs]
    kept = [log for log, why in zip(logs, reasons, strict=True) if not why]
    if not falling or all(set(drive) & set(log.columns()) for log in kept):
        return reasons
    falls = [why or _no_coast(log.guesses[falling].facts) for log, why in zip(logs, reasons, strict=True)]
    return falls if not all(falls) else reasons


def _key(log: GuessedLog, needed: Collection[str]) -> tuple[tuple[str, tuple[tuple[Words, str], str]], ...]:
    return tuple((n, at) for n, at in log.meanings().items() if n in needed)


def _unlike(log: GuessedLog, usual: GuessedLog, needed: Collection[str]) -> str:
    own, others = dict(_key(log, needed)), dict(_key(usual, needed))
    if own == others:
        return ""
    lacking = [f"no {n}: {log.guesses[n].why}" for n in others if n not in own]
    if lacking:
        return "; ".join(lacking)
    differs = ", ".join(n for n in own if own[n] != others.get(n))
    return f"other columns than {usual.path.name} ({differs}): describe such logs in a file of their own"


def _no_coast(facts: ChannelFacts | None) -> str:
    if facts is None:
        return ""
    fall, length = facts.longest_fall, facts.info.span[1] - facts.info.span[0]
    if not fall < min(_LEAST_FALL, 0.5 * length):
        return ""
    return f"no coast-down, the speed falls for at most {fall:.0f} s of {length:.0f} s at a time"
