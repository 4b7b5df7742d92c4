"""The lines of a description that map a log's columns to the channels of a step."""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence

from vdyn_cli.project.drafting.channel_guess import NO_NAME, NOT_DECIDED, ChannelGuess, battery_columns, columns_by_unit
from vdyn_cli.project.drafting.left_out_logs import GuessedLog
from vdyn_cli.steps import Step
from vdyn_cli.steps.step_definition import alternative_channels, named_channels

_MOST_NAMED = 4  # columns listed for a required channel; of more only the number is stated
_MOST_UNUSED = 12  # unused columns listed by name
_MOST_LOGS = 3  # logs listed by name
_LONGEST_LINE = 150  # characters of a line with its comment; longer comments are written above
UNUSED = "  # unused columns:"


def channel_lines(
    step: Step, log: GuessedLog, logs: Sequence[GuessedLog], required: bool, elsewhere: Collection[str] = ()
) -> tuple[list[str], list[str], list[str]]:
    """The lines of a log's channels, the mapped channels, and the required ones that are undecided.

    Parameters
    ----------
    elsewhere : channels that other loggers have, or lack as well; no line states that this log has none.
    """
    lines: list[str] = []
    mapped: list[str] = []
    undecided: list[str] = []
    left: list[str] = []
    alternatives = {n for entry in step.required for n in named_channels(entry)}
    needed = channels_needed(step, [log]) - alternatives | set(_ways(step, log, step.required))
    for channel in _ways(step, log, (*step.required, *step.optional)):
        guess = log.guesses[channel]
        if channel == "time" and guess.facts is None:
            continue  # of a log with a fixed rate
        missing = [o for o in logs if not o.agrees(log, channel)]
        if guess.facts is not None and not missing:
            lines += channel_line(channel, guess)
            mapped.append(channel)
            if guess.unit == "?":
                undecided.append(f"unit of {channel}")
        elif channel in needed and required:
            lines.append(
                f'  {channel}: {{column: "?", unit: "?"}}  # needed: {guess.why}{fitting_columns(step, log, channel)}'
            )
            undecided.append(channel)
        elif missing:
            lines.append(f"  # {channel}: {_not_in_all(channel, log, missing)}")
        elif guess.why != NO_NAME:
            lines.append(f"  # {channel}: {guess.why}")
        elif channel not in elsewhere:
            left.append(channel)
    if left:
        lines.append(f"  # optional, and {NO_NAME}: {', '.join(left)}")
    lines += _battery_power(step, log, mapped)
    return [*lines, *unused_columns(log, lines)], mapped, undecided


def _not_in_all(channel: str, log: GuessedLog, missing: Sequence[GuessedLog]) -> str:
    """Why a channel is not mapped that some logs have, or have in another column, and what to do to map it."""
    names = list(dict.fromkeys(one.name for one in missing))
    listed = ", ".join(names[:_MOST_LOGS]) + (f" and {len(names) - _MOST_LOGS} more" if len(names) > _MOST_LOGS else "")
    guess = log.guesses[channel]
    if guess.facts is None:
        return f"not mapped, since {log.name} has none ({guess.why}); to map it, describe {listed} in another file"
    why = {one.guesses[channel].why if one.guesses[channel].facts is None else "another column" for one in missing}
    fact = f"{quoted(guess.facts.column)} of {log.name} is not in {listed} ({'; '.join(sorted(why))})"
    return f"{fact}; to map it, describe these in another file"


def _battery_power(step: Step, log: GuessedLog, mapped: Collection[str]) -> list[str]:
    """How the power of a battery can drive the car, in a step that uses a power; none where another drive is logged."""
    drives = {name for one in step.scaled if one.source == "drive_power" for name in (one.source, one.target)}
    found = battery_columns(log.facts)
    if not drives or found is None or drives & set(mapped) or {"drive_torque", "motor_current"} & set(mapped):
        return []
    return [
        f"  # {quoted(found[0])} times {quoted(found[1])} is the battery's power, not that of the wheels. To use it,",
        "  # write the product into the logs, in W, positive when it drives, without heating and other loads; map it",
        "  # as drive_power, with driveline_efficiency of inverter, motor and gear under vehicle (0.85 +- 0.05).",
    ]


def unused_columns(log: GuessedLog, lines: Sequence[str]) -> list[str]:
    """The line that lists the columns of numbers that the lines of the channels do not name; none without any."""
    text = "\n".join(lines)
    numbers = dict.fromkeys(f.column for f in log.facts if f.state in ("varies", "constant"))
    names = [name for name in numbers if quoted(name) not in text and f"'{name}'" not in text]
    more = f" and {len(names) - _MOST_UNUSED} more, see 'vdyn channels'" if len(names) > _MOST_UNUSED else ""
    return [f"{UNUSED} {', '.join(map(quoted, names[:_MOST_UNUSED]))}{more}"] if names else []


def channel_line(channel: str, guess: ChannelGuess) -> list[str]:
    """The line of a mapped channel with the reason of its guess; the reason is above where both are long."""
    assert guess.facts is not None
    info = guess.facts.info
    several = bool(info.group) and guess.facts.repeated > 1 and channel != "time"
    group = f", group: {quoted(info.group)}" if several else ""
    sign = "" if guess.sign > 0 else f", sign: {guess.sign}"
    plain = guess.unit.replace("/", "").replace(" ", "").isalpha()
    unit = guess.unit if plain else quoted(guess.unit)
    line = f"  {channel}: {{column: {quoted(guess.facts.column)}, unit: {unit}{group}{sign}}}"
    comment = f"# {guess.why}"
    return [f"{line}  {comment}"] if len(line) + len(comment) < _LONGEST_LINE else [f"  {comment}", line]


def quoted(text: str) -> str:
    """A text in quotes that are valid in YAML and JSON."""
    return json.dumps(text, ensure_ascii=False)


def channels_needed(step: Step, logs: Sequence[GuessedLog]) -> set[str]:
    """The required channels of a step, and those from which the logs' missing ones can be computed."""
    names = {n for entry in step.required for n in named_channels(entry)}
    found = {n for log in logs for n in log.columns()}
    return names | {one.source for one in step.scaled if one.target in names - found}


def source_of(step: Step, channel: str, log: GuessedLog) -> str:
    """The channel from which a step can compute one that the log lacks, such as a wheel speed; else the channel.

    Columns that fit the channel, but are not decided, are better than a channel from which it can be computed.
    """
    found = log.columns()
    if channel in log.guesses and log.guesses[channel].why.startswith(NOT_DECIDED):
        return channel
    sources = [one.source for one in step.scaled if one.target == channel and one.source in found]
    return channel if channel in found or not sources else sources[0]


def fitting_columns(step: Step, log: GuessedLog, channel: str) -> str:
    """Text of the unmapped columns whose unit fits a channel, or one from which it can be computed; empty if several
    columns fit by name."""
    if "'" in log.guesses[channel].why:
        return ""
    used = log.columns().values()
    free = [f for f in log.facts if (f.column, f.info.group) not in used]
    text = ""
    for name in (channel, *(one.source for one in step.scaled if one.target == channel)):
        found = columns_by_unit(step.channels()[name], free)
        more = f" and {len(found) - _MOST_NAMED} more" if len(found) > _MOST_NAMED else ""
        instead = "" if name == channel else f"map '{name}' instead: "
        text += f"; {instead}by their unit: {', '.join(quoted(c) for c in found[:_MOST_NAMED])}{more}" if found else ""
    return text


def _ways(step: Step, log: GuessedLog, entries: Sequence[str]) -> list[str]:
    """The channels of entries of a step in order; of alternative channels, the one that the log has."""
    found = log.columns()
    chosen: list[str] = []
    for entry in entries:
        ways = alternative_channels(entry)
        whole = [way for way in ways if all(part in found for part in way)]
        chosen += [source_of(step, channel, log) for channel in (whole or ways)[0]]
    return list(dict.fromkeys(chosen))
