"""The runs of a draft from guessed logs: of one log each, or of one log of each of several loggers."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from vdyn_cli.io.channel_survey import ChannelFacts, remedy_of_increasing
from vdyn_cli.io.clocks.tied_channels import ties
from vdyn_cli.project.drafting.channel_guess import ChannelGuess, guess_channels
from vdyn_cli.project.drafting.drafted_channels import (
    UNUSED,
    channel_line,
    channel_lines,
    channels_needed,
    fitting_columns,
    quoted,
    source_of,
    unused_columns,
)
from vdyn_cli.project.drafting.left_out_logs import (
    GuessedLog,
    reference_log,
    split_coast_downs,
    split_recordings,
    why_left_out,
    without_coast_down,
)
from vdyn_cli.project.drafting.logger_runs import Runs
from vdyn_cli.quantities.vocabulary import CHANNELS, WHEEL_SPEEDS
from vdyn_cli.steps import Step
from vdyn_cli.steps.step_definition import alternative_channels

_ONE_RUN = (
    "# The logs have different columns over the same time, so they are taken as several loggers of one run; if they",
    "# are separate runs, write one description for each.",
)
_SEVERAL_RUNS = (
    "# Each run has one log of each logger; check the pairs: the logs were matched by their times, or",
    "# by the part in which their names differ.",
)
_ALONE = "no matching log of the other logger"
# Ratio of mean decelerations, above which two parts of a log are not both coast-downs: slope and wind change it by 15 %
# each way, and a first speed of 30 instead of 20 m/s by a third.
_UNLIKE = 1.8
_NOT_RELATED = (
    "and no mapped channel relates its clock to the first one: map two channels of the same, or write 'delay: 0 s' if "
    "both have one clock"
)


@dataclass(frozen=True)
class DraftedRuns:
    """The channels and runs of a test before directions and conditions are known.

    Parameters
    ----------
    lines : of the channels. mapped, undecided : their names.
    entries : of every log or run, kept ones first where there are several loggers.
    left_out : why an entry is not a run; empty for a run.
    kept : the log of each run that shows when it was driven. keys : further keys of each run.
    facts : of each logger, the facts on each run's log.
    """

    lines: list[str]
    mapped: list[str]
    undecided: list[str]
    entries: list[str]
    left_out: list[str]
    kept: list[GuessedLog]
    keys: list[str]
    facts: list[list[tuple[ChannelFacts, ...]]]


def runs_of_loggers(step: Step, logs: Sequence[GuessedLog], found: Runs, folder: Path) -> DraftedRuns:
    """Runs with one log of each logger; logs that belong to none are left out.

    Parameters
    ----------
    logs : all that were given. found : the logs of each run, in the order of the loggers.
    folder : of the description, to which the names of logs are relative.
    """
    useful = [k for k, log in enumerate(found[0]) if len(log.columns()) > 1]
    useful = _in_order(step, found[0], useful)
    lines, mapped, undecided = _loggers(step, found, useful)
    alone = [log for log in logs if not any(log is one for run in found for one in run)]
    names = [", ".join(quoted(relative_path(folder, run[k].path)) for k in useful) for run in found]
    entries = [f"logs: [{each}]" for each in names] + [
        f"log: {quoted(relative_path(folder, log.path))}" for log in alone
    ]
    left_out = [""] * len(found) + [_ALONE] * len(alone)
    shown = next((k for k in useful if "speed" in found[0][k].columns()), useful[0])
    kept, differ = [run[shown] for run in found], [_keys_of_loggers(run, found[0], useful) for run in found]
    facts = [[run[k].facts for run in found] for k in useful]
    return DraftedRuns(lines, mapped, undecided, entries, left_out, kept, differ, facts)


def _in_order(step: Step, logs: Sequence[GuessedLog], useful: Sequence[int]) -> list[int]:
    """The loggers with the one first to whose clock the others are resampled.

    That is the one with what the step needs besides the speed: a drive torque changes faster than a car's speed.
    """
    needed = channels_needed(step, logs) - {"time", "speed"}
    return sorted(useful, key=lambda k: (not needed & set(logs[k].columns()), "speed" not in logs[k].columns()))


def runs_of_one_logger(
    step: Step, logs: Sequence[GuessedLog], falling: str, drive: Sequence[str], folder: Path
) -> DraftedRuns:
    """Runs of one log each, or of its coast-downs; logs that are not runs are left out.

    Parameters
    ----------
    falling : channel that falls in a coast-down. drive : channels of which a log has none in a coast-down.
    folder : of the description, to which the names of logs are relative.
    """
    falling = source_of(step, falling, logs[0])
    whole = [one for log in logs for one in split_recordings(log)]
    logs = [part for one in whole for part in split_coast_downs(one, falling, drive)]
    usual = reference_log(logs, channels_needed(step, logs))
    left_out = why_left_out(logs, usual, channels_needed(step, logs), falling, drive)
    kept = [log for log, why in zip(logs, left_out, strict=True) if not why]
    lines, mapped, undecided = channel_lines(step, usual, kept, required=True)
    windows = [log.window if why else "" for log, why in zip(logs, left_out, strict=True)]
    entries = [f"log: {quoted(relative_path(folder, log.path))}{own}" for log, own in zip(logs, windows, strict=True)]
    differ = ["".join(f", {key}: {own}" for key, own in log.differing(usual, mapped).items()) for log in kept]
    split = _parts_of_logs(kept) if len(logs) > len(whole) else []
    undecided += ["which parts are coast-downs"] if split and _differ(kept) else []
    return DraftedRuns(
        [*_reading(kept), "channels:", *lines, *without_coast_down(kept, falling, drive), *split],
        mapped,
        undecided,
        entries,
        left_out,
        kept,
        differ,
        [[log.facts for log in kept]],
    )


def _parts_of_logs(parts: Sequence[GuessedLog]) -> list[str]:
    """The comment on runs that are parts of a log, with their mean decelerations if they are known."""
    lines = ["  # parts of a log in which the speed decreases: remove those that were braked or driven"]
    known = [part.deceleration for part in parts if math.isfinite(part.deceleration)]
    if len(known) < max(len(parts), 2):
        return lines
    listed = ", ".join(f"{one:.2f}" for one in known)
    but = ", so that not all of these are" if _differ(parts) else ""
    return [*lines, f"  # mean decelerations of the runs: {listed} m/s^2; those of coast-downs are alike{but}"]


def _differ(parts: Sequence[GuessedLog]) -> bool:
    """Whether the parts of a log decelerate so differently that some of them are no coast-downs."""
    known = [part.deceleration for part in parts if math.isfinite(part.deceleration)]
    return bool(known) and max(known) > _UNLIKE * min(known)


def _reading(logs: Sequence[GuessedLog]) -> list[str]:
    """The line that states the rate of logs without a clock, or leaves out rows whose time does not increase; none if
    neither is needed."""
    if logs and logs[0].guesses["time"].facts is None:
        line = 'reading: {rate: "?"}        # no clock by its name: write the rate of the rows, such as 10 Hz'
        other = remedy_of_increasing(logs[0].facts)
        return [line, *([f"# {other}, without 'reading'"] if other else [])]
    late = {log.path: facts.info.late for log in logs if (facts := log.guesses["time"].facts) is not None}
    rows = sum(late.values())
    return [f"reading: {{clock: drop}}    # {rows} rows have a time that steps back"] if rows else []


def _keys_of_loggers(run: Sequence[GuessedLog], first: Sequence[GuessedLog], useful: Sequence[int]) -> str:
    """The keys of a run for columns, units or signs that differ from the first run's, with an entry for each logger."""
    found = [run[k].differing(first[k], run[k].columns()) for k in useful]
    keys = dict.fromkeys(key for each in found for key in each)
    return "".join(f", {key}: [{', '.join(each.get(key, 'null') for each in found)}]" for key in keys)


def _loggers(step: Step, runs: Runs, useful: Sequence[int]) -> tuple[list[str], list[str], list[str]]:
    """The lines of several loggers, the mapped channels, and the undecided keys.

    Parameters
    ----------
    useful : indices of the loggers with a channel of the step other than the time.
    """
    lines = [*(_ONE_RUN if len(runs) == 1 else _SEVERAL_RUNS), "loggers:"]
    mapped: list[str] = []
    undecided: list[str] = []
    reference: list[str] = []  # channels of the first logger, whose clock is that of the runs
    for k in useful:
        elsewhere = mapped if k == useful[-1] else tuple(step.channels())  # the last one's lines state what none has
        logs = [run[k] for run in runs]
        log = logs[0]
        own, found, open_ones = channel_lines(step, log, logs, False, elsewhere)
        if "speed" not in found:
            first = reference if k != useful[0] else runs[0][useful[-1]].columns()
            alike = any(t.order == 0 for t in ties(first, found))  # not one the derivative of the other
            if not alike and (wheel := _wheel_speed(step, logs)) and ties(first, [wheel[0]]):
                own = [line for line in own if not line.startswith(UNUSED)] + wheel[1]
                own, found = [*own, *unused_columns(log, own)], [*found, wheel[0]]
            tie = min(ties(first, found), key=lambda tie: tie.order != 0, default=None)
            how = f"its clock is aligned by {tie}" if tie else _NOT_RELATED
            own.append(f"  # another logger of the run, not a run: it has no speed; {how}")
            undecided += [] if tie else [f"channel to align {log.path.name} on"]
        reference = found if k == useful[0] else reference
        lines += [f"  - channels:               # {log.path.name}", *("    " + line for line in own)]
        mapped += found
        undecided += [f"{key} ({log.path.name})" for key in open_ones]
    for name, ways in _unfound(step, mapped).items():
        fitting = "".join(fitting_columns(step, runs[0][k], name) for k in useful)
        lines.append(f"# {ways}: needed, but not found in any of the logs{fitting}")
        undecided.append(name)
    for k, log in enumerate(runs[0]):
        if k not in useful:
            reasons = [f"{c}: {g.why}" for c, g in log.guesses.items() if g.facts is None and "'" in g.why]
            names = ", ".join(dict.fromkeys(run[k].path.name for run in runs))
            lines.append(f"# left out: {names}, " + ("; ".join(reasons) or "no column fits this step"))
    return lines, mapped, undecided


def _wheel_speed(step: Step, logs: Sequence[GuessedLog]) -> tuple[str, list[str]] | None:
    """A wheel speed that all logs of a logger have, and its lines: it shows the delay better than an acceleration.

    In a step that knows no single wheels, it is the ``wheel_speed``, which then aligns the clocks only.
    """
    known = step.channels()
    wanted = {n: CHANNELS[n] for n in ("wheel_speed", *WHEEL_SPEEDS)}
    first, *others = [guess_channels(wanted, log.facts, log.path.name) for log in logs]
    for channel, guess in first.items():
        own = _mapped_as(guess)
        name = channel if channel in known else "wheel_speed"
        if own and guess.unit != "?" and all(_mapped_as(other[channel]) == own for other in others):
            return name, channel_line(name, guess)
    return None


def _mapped_as(guess: ChannelGuess) -> tuple[str, str, int] | None:
    return None if guess.facts is None else (guess.facts.column, guess.unit, guess.sign)


def _unfound(step: Step, mapped: Sequence[str]) -> dict[str, str]:
    """Required channels that no logger has, each with the text of its alternatives."""
    open_ones = {}
    for entry in step.required:
        ways = alternative_channels(entry)
        if not any(set(way) <= set(mapped) for way in ways):
            open_ones[ways[0][0]] = ", or ".join(" with ".join(way) for way in ways)
    return open_ones


def relative_path(folder: Path, path: Path) -> str:
    """The path of a log relative to the description's folder."""
    return os.path.relpath(path.resolve(), folder.resolve())
