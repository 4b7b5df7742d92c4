"""A first description of unknown logs: guessed channels with reasons, and a mark at every key left to the user."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from vdyn_cli.io.channel_survey import ChannelFacts, survey, without_clock
from vdyn_cli.io.clocks.tied_channels import ties
from vdyn_cli.io.files import distinct_names
from vdyn_cli.project.drafting.channel_guess import NO_NAME, ChannelGuess, columns_by_unit, guess_channels
from vdyn_cli.project.drafting.left_out_logs import GuessedLog, reference_log, split_coast_downs, why_left_out
from vdyn_cli.project.drafting.logger_runs import Runs, logger_runs, unmatched
from vdyn_cli.project.drafting.run_conditions import air_during, run_conditions
from vdyn_cli.project.drafting.run_direction import LoggedDirection, logged_directions
from vdyn_cli.project.drafting.station_log import StationLog, is_station, station_log
from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.vocabulary import CHANNELS
from vdyn_cli.steps import Step
from vdyn_cli.steps.step_definition import alternatives, named_channels

_ONE_RUN = (
    "# The logs have different columns over the same time, so they are taken as several loggers of one run; if they",
    "# are separate runs, write one description for each.",
)
_SEVERAL_RUNS = (
    "# Each run has one log of each logger; check the pairs: the logs were matched by their times, or",
    "# by the part in which their names differ.",
)
_UNMATCHED = (
    "the logs look like those of several loggers, but neither their clocks nor their names show which are of one",
    "run: give the files of a run the same number, such as can_1.csv and gps_1.csv, and run init again",
)
_ALONE = "no matching log of the other logger, or other columns or units than the first run"
_HEAD = "# A first description by 'vdyn init'. \"?\" marks values that the logs do not contain: write them there."
_MOST_NAMED = 4  # columns listed for a required channel; of more only the number is stated
_LONGEST = 150  # characters of a line with its comment; longer comments are written above


@dataclass(frozen=True)
class DescriptionDraft:
    """The text of a description, the mapped channels, the keys left to the user, and the logs that are not runs."""

    text: str
    mapped: tuple[str, ...]
    undecided: tuple[str, ...]
    left: tuple[str, ...] = ()


def draft_description(step: Step, paths: Sequence[Path], folder: Path) -> DescriptionDraft:
    """The commented YAML of a step's test for some logs.

    Parameters
    ----------
    paths : the logs, of any format: runs if they have the same columns, else several loggers of one run. Of several
        logs, those that cannot be runs are written as comments with the reason.
    folder : of the description; the logs' paths are relative to it.

    Raises
    ------
    InputError : the step reads no logs, a file does not exist, or no file is a log.
    """
    if not step.required:
        what = f"the step '{step.name}' reads no logs, so that no description can be drafted"
        raise InputError(
            Finding(step.name, what, remedy=f"see 'vdyn explain {step.name}' and configs/{step.name}.yaml")
        )
    parts = _parts(step)
    tables = [path for path in paths if "table_runs" in parts and parts["table_runs"](path)]
    logs, problems = _read(step, [path for path in paths if path not in tables])
    if not (logs or tables) or not all(path.exists() for path in paths):
        raise_all(problems)
    if tables:
        return _of_tables(step, parts, tables, logs, folder)
    swings = [c for c in parts.get("PENDULUM_CHANNELS", ()) if logs[0].guesses[c].facts is not None]
    head = [_HEAD, f"test: {step.name}"]
    if swings and not _decided(step, logs[0]):
        body, mapped, undecided = _pendulum(logs[0], swings[:1], parts, folder)
    else:
        body, mapped, undecided = _drives(step, *_with_station(logs, parts), folder)
    body += [f"# left out: {f.where}, {f.what}" for f in problems]
    text = "\n".join([*head, *body]) + "\n"
    left = re.findall(r'^\s*# (?:- \{log: "(.+?)"\}  # )?left out: (?:(.+?),)?', text, re.MULTILINE)
    return DescriptionDraft(text, mapped, (*undecided, *_marked(text)), tuple(a or b for a, b in left))


def _of_tables(
    step: Step, parts: Mapping[str, Any], tables: Sequence[Path], logs: Sequence[GuessedLog], folder: Path
) -> DescriptionDraft:
    """The draft for files that the step recognizes as tables of runs, with a station's air; other logs are left out."""
    stations = [log for log in logs if is_station(log.facts)]
    station = station_log(stations[0].path, stations[0].facts) if stations else None
    runs = [run for path in tables for run in parts["table_runs"](path)]
    known = [(None if math.isnan(begin) else begin, length) for begin, length in runs]
    _, air, note = air_during(station, known) if station is not None else ([], (), "")
    body = [filled for line in parts["DRAFT"].splitlines() for filled in _filled(line, air)]
    body += parts["table_draft"](tables, [_from(folder, path) for path in tables])
    others = [log.name for log in logs if station is None or log is not stations[0]]
    body += [f"# {note}"] if note else []
    body += [f"# left out: {name}, is a log, not a table of runs: describe it in a separate file" for name in others]
    text = "\n".join([_HEAD, f"test: {step.name}", *body]) + "\n"
    return DescriptionDraft(text, ("time", "speed"), tuple(_marked(text)), tuple(others))


def _read(step: Step, paths: Sequence[Path]) -> tuple[list[GuessedLog], list[Finding]]:
    wanted = dict(step.channels())
    wanted |= {c: CHANNELS[c] for c in _parts(step).get("PENDULUM_CHANNELS", ())}
    logs: list[GuessedLog] = []
    problems: list[Finding] = []
    for path, name in distinct_names(paths).items():
        try:
            facts = survey(path)
        except InputError as error:
            problems += [f.renamed(path.name, name) for f in error.findings]
            continue
        guessed = GuessedLog(path, facts, guess_channels(wanted, facts, path.name), name)
        if guessed.guesses["time"].facts is None:
            what, remedy = without_clock(facts)
            problems.append(Finding(name, f"is not a log: {what}", remedy=remedy))
            continue
        logs.append(guessed)
    return logs, problems


def _parts(step: Step) -> Mapping[str, Any]:
    """The definitions in the step's module ``draft``; empty for a step of another package."""
    name = f"vdyn_cli.steps.{step.name}.draft"
    try:
        return vars(import_module(name)) if find_spec(name) else {}
    except ModuleNotFoundError:
        return {}


def _decided(step: Step, log: GuessedLog) -> bool:
    """Whether any required channel other than the time is found."""
    return any(part in log.columns() for entry in step.required for part in named_channels(entry) if part != "time")


def _needed(step: Step, logs: Sequence[GuessedLog]) -> set[str]:
    names = {n for entry in step.required for n in named_channels(entry)}
    found = {n for log in logs for n in log.columns()}
    return names | {one.source for one in step.scaled if one.target in names - found}


def _instead(step: Step, channel: str, log: GuessedLog) -> str:
    """The channel from which a step can compute one that the log lacks, such as a wheel speed; else the channel."""
    found = log.columns()
    sources = [one.source for one in step.scaled if one.target == channel and one.source in found]
    return channel if channel in found or not sources else sources[0]


def _with_station(
    logs: Sequence[GuessedLog], parts: Mapping[str, Any]
) -> tuple[list[GuessedLog], Mapping[str, Any], StationLog | None]:
    """The logs of the runs, the step's parts, and the log of a weather station among them (None without one)."""
    stations = [log for log in logs if is_station(log.facts)] if "environment:" in parts.get("DRAFT", "") else []
    if not stations or len(stations) == len(logs):
        return list(logs), parts, None
    return [log for log in logs if log not in stations], parts, station_log(stations[0].path, stations[0].facts)


@dataclass(frozen=True)
class _DraftedRuns:
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


def _drives(
    step: Step, logs: Sequence[GuessedLog], parts: Mapping[str, Any], station: StationLog | None, folder: Path
) -> tuple[list[str], tuple[str, ...], tuple[str, ...]]:
    """Vehicle, channels and runs of a test with driven runs."""
    key = str(parts.get("RUN", ""))
    required = [n for entry in step.required for n in named_channels(entry)]
    notes = _UNMATCHED if unmatched(logs, required) else ()
    if of_loggers := logger_runs(logs, required):
        made = _runs_of_loggers(step, logs, of_loggers, folder)
    else:
        made = _runs_of_one_logger(step, logs, str(parts.get("FALLING", "")), parts.get("DRIVE", ()), folder)
    ways = _first_directions(made.facts) if key.startswith("direction") else ()
    found = run_conditions([log.facts for log in made.kept], ways, station, step.run_keys or ())
    own = [log.window + keys + other for log, keys, other in zip(made.kept, found.keys, made.keys, strict=True)]
    runs, decided = _runs(made.entries, made.left_out, key, ways, own)
    body = [filled for line in parts.get("DRAFT", "").splitlines() for filled in _filled(line, found.air)]
    at = body.index("vehicle:") + 1 if "vehicle:" in body else 0
    body[at:at] = _constants(step, made.mapped, body)
    body += [*made.lines, "runs:", *(f"  # {note}" for note in (*notes, *found.notes)), *runs]
    undecided = list(made.undecided)
    if key and not key.startswith("side") and not decided:
        body.append(f"  # not decided by the logs, for each run: {key}")
        undecided.append(f"{key.split(':')[0]} of each run")
    body += parts.get("SETTINGS", "").splitlines()
    return body, tuple(dict.fromkeys(made.mapped)), tuple(undecided)


def _runs_of_loggers(step: Step, logs: Sequence[GuessedLog], found: Runs, folder: Path) -> _DraftedRuns:
    """Runs with one log of each logger; logs that belong to none are left out."""
    useful = [k for k, log in enumerate(found[0]) if len(log.columns()) > 1]
    useful.sort(key=lambda k: "speed" not in found[0][k].columns())  # others are resampled to the first
    keys = [_keys_of_loggers(run, found[0], useful) for run in found]
    runs = tuple(run for run, one in zip(found, keys, strict=True) if one is not None)
    lines, mapped, undecided = _loggers(step, runs, useful)
    alone = [log for log in logs if not any(log is one for run in runs for one in run)]
    names = [", ".join(_quoted(_from(folder, run[k].path)) for k in useful) for run in runs]
    entries = [f"logs: [{each}]" for each in names] + [f"log: {_quoted(_from(folder, log.path))}" for log in alone]
    left_out = [""] * len(runs) + [_ALONE] * len(alone)
    kept, differ = [run[useful[0]] for run in runs], [one for one in keys if one is not None]
    facts = [[run[k].facts for run in runs] for k in useful]
    return _DraftedRuns(lines, mapped, undecided, entries, left_out, kept, differ, facts)


def _runs_of_one_logger(
    step: Step, logs: Sequence[GuessedLog], falling: str, drive: Sequence[str], folder: Path
) -> _DraftedRuns:
    """Runs of one log each, or of its coast-downs; logs that are not runs are left out."""
    falling = _instead(step, falling, logs[0])
    logs = [part for log in logs for part in split_coast_downs(log, falling, drive)]
    usual = reference_log(logs, _needed(step, logs))
    left_out = why_left_out(logs, usual, _needed(step, logs), falling, drive)
    kept = [log for log, why in zip(logs, left_out, strict=True) if not why]
    lines, mapped, undecided = _channels(step, usual, kept, required=True)
    entries = [f"log: {_quoted(_from(folder, log.path))}" for log in logs]
    differ = [log.differing(usual, mapped) for log in kept]
    return _DraftedRuns(
        ["channels:", *lines], mapped, undecided, entries, left_out, kept, differ, [[log.facts for log in kept]]
    )


def _keys_of_loggers(run: Sequence[GuessedLog], first: Sequence[GuessedLog], useful: Sequence[int]) -> str | None:
    """The keys of a run for columns or units that differ from the first run's; None if a key would wrongly apply to
    the logs of other loggers, too."""
    found: list[str] = []
    for k in useful:
        others = {c for j in useful if j != k for c in run[j].columns()}
        if run[k].differing(first[k], [c for c in run[k].columns() if c in others]):
            return None
        found.append(run[k].differing(first[k], [c for c in run[k].columns() if c not in others]))
    return "".join(found) if sum(map(bool, found)) < 2 else None


def _constants(step: Step, mapped: Sequence[str], body: Sequence[str]) -> list[str]:
    """The vehicle's constants that are needed to compute channels from others."""
    made = [one for one in step.scaled if one.source in mapped and one.target not in mapped]
    lines = [f'  {name}: "?"  # {one.equation}' for one in made for name in one.constants]
    return [line for line in lines if not any(other.startswith(line.split(":")[0] + ":") for other in body)]


def _filled(line: str, air: Sequence[tuple[str, str]]) -> list[str]:
    """A line of the environment with a station's values; the optional humidity follows the pressure."""
    own = [name for name in ("temperature", "pressure") if line.strip().startswith(f'{name}: "?"')]
    wanted = [*own, *(["humidity"] if own == ["pressure"] else [])]
    return [f"  {name}: {text}" for name, text in air if name in wanted] or [line]


def _first_directions(loggers: Sequence[Sequence[Sequence[ChannelFacts]]]) -> tuple[LoggedDirection, ...]:
    """The direction of each run from the first logger that shows any; empty directions if none does."""
    found = [logged_directions(runs) for runs in loggers]
    return next((ways for ways in found if any(way.direction for way in ways)), found[0])


def _runs(
    entries: Sequence[str], others: Sequence[str], key: str, ways: Sequence[LoggedDirection], own: Sequence[str]
) -> tuple[list[str], bool]:
    """The lines of the runs, and whether each has its direction; logs that are not runs are written as comments.

    Parameters
    ----------
    entries, others : for each run, its log or logs as text, and why it is not a run. key : required in each run.
    ways, own : for each run, its direction, and further keys as text.
    """
    lines, decided, run = [], bool(ways), 0
    for entry, other in zip(entries, others, strict=True):
        log = f"{{{entry}"
        if other:
            lines.append(f"  # - {log}}}  # left out: {other}")
            continue
        way = ways[run].direction if ways else ""
        reason = f"  # {ways[run].why}" if ways and ways[run].why else ""
        decided = decided and bool(way)
        side = f", direction: {way}" if way else f", {key}" if key.startswith("side") else ""
        lines.append(f"  - {log}{side}{own[run]}}}{reason}")
        run += 1
    return lines, decided


def _loggers(step: Step, runs: Runs, useful: Sequence[int]) -> tuple[list[str], list[str], list[str]]:
    """The lines of several loggers, the mapped channels, and the undecided keys.

    Parameters
    ----------
    useful : indices of the loggers with a channel of the step other than the time.
    """
    lines = [*(_ONE_RUN if len(runs) == 1 else _SEVERAL_RUNS), "loggers:"]
    mapped: list[str] = []
    undecided: list[str] = []
    for k in useful:
        own, found, open_ones = _channels(step, runs[0][k], [run[k] for run in runs], required=False)
        log = runs[0][k]
        if "speed" not in found:
            tied = ties(runs[0][useful[0]].columns(), found)
            how = (
                f"its clock is aligned by {tied[0]}"
                if tied
                else "and no mapped channel relates its clock to the first one: map two channels of the same, "
                "or write 'delay: 0 s' if both have one clock"
            )
            own.append(f"  # another logger of the run, not a run: it has no speed; {how}")
            undecided += [] if tied else [f"channel to align {log.path.name} on"]
        lines += [f"  - channels:               # {log.path.name}", *("    " + line for line in own)]
        mapped += found
        undecided += [f"{key} ({log.path.name})" for key in open_ones]
    lines += [f"# {name}: needed, but not found in any of the logs" for name in _unfound(step, mapped)]
    undecided += _unfound(step, mapped)
    for k, log in enumerate(runs[0]):
        if k not in useful:
            reasons = [f"{c}: {g.why}" for c, g in log.guesses.items() if g.facts is None and "'" in g.why]
            names = ", ".join(dict.fromkeys(run[k].path.name for run in runs))
            lines.append(f"# left out: {names}, " + ("; ".join(reasons) or "no column fits this step"))
    return lines, mapped, undecided


def _channels(
    step: Step, log: GuessedLog, logs: Sequence[GuessedLog], required: bool
) -> tuple[list[str], list[str], list[str]]:
    """The lines of a log's channels, the mapped channels, and the required ones that are undecided."""
    lines: list[str] = []
    mapped: list[str] = []
    undecided: list[str] = []
    left: list[str] = []
    needed = _needed(step, [log])
    for channel in _ways(step, log):
        guess = log.guesses[channel]
        missing = [o.name for o in logs if o.decided_columns().get(channel) != log.decided_columns().get(channel)]
        if guess.facts is not None and not missing:
            lines += _line(channel, guess)
            mapped.append(channel)
            if guess.unit == "?":
                undecided.append(f"unit of {channel}")
        elif channel in needed and required:
            lines.append(
                f'  {channel}: {{column: "?", unit: "?"}}  # needed: {guess.why}{_by_unit(step, log, channel)}'
            )
            undecided.append(channel)
        elif missing:
            lines.append(
                f"  # {channel}: a different column, or none, in {', '.join(missing[:3])}: map it without these"
            )
        elif guess.why != NO_NAME:
            lines.append(f"  # {channel}: {guess.why}")
        else:
            left.append(channel)
    if left:
        lines.append(f"  # optional, and {NO_NAME}: {', '.join(left)}")
    return lines, mapped, undecided


def _by_unit(step: Step, log: GuessedLog, channel: str) -> str:
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
        text += f"; {instead}by their unit: {', '.join(_quoted(c) for c in found[:_MOST_NAMED])}{more}" if found else ""
    return text


def _ways(step: Step, log: GuessedLog) -> list[str]:
    """The channels of a step in order; of alternative channels, the one that the log has."""
    found = log.columns()
    chosen: list[str] = []
    for entry in (*step.required, *step.optional):
        ways = alternatives(entry)
        whole = [way for way in ways if all(part in found for part in way)]
        chosen += [_instead(step, channel, log) for channel in (whole or ways)[0]]
    return list(dict.fromkeys(chosen))


def _line(channel: str, guess: ChannelGuess) -> list[str]:
    assert guess.facts is not None
    info = guess.facts.info
    several = bool(info.group) and guess.facts.repeated > 1 and channel != "time"
    group = f", group: {_quoted(info.group)}" if several else ""
    sign = "" if guess.sign > 0 else f", sign: {guess.sign}"
    plain = guess.unit.replace("/", "").replace(" ", "").isalpha()
    unit = guess.unit if plain else _quoted(guess.unit)
    line = f"  {channel}: {{column: {_quoted(guess.facts.column)}, unit: {unit}{group}{sign}}}"
    comment = f"# {guess.why}"
    return [f"{line}  {comment}"] if len(line) + len(comment) < _LONGEST else [f"  {comment}", line]


def _quoted(text: str) -> str:
    """A text in quotes that are valid in YAML and JSON."""
    return json.dumps(text, ensure_ascii=False)


def _unfound(step: Step, mapped: Sequence[str]) -> list[str]:
    """Required channels that no logger has."""
    open_ones = []
    for entry in step.required:
        ways = alternatives(entry)
        if not any(set(way) <= set(mapped) for way in ways):
            open_ones.append(ways[0][0])
    return open_ones


def _pendulum(
    log: GuessedLog, swings: Sequence[str], parts: Mapping[str, Any], folder: Path
) -> tuple[list[str], tuple[str, ...], tuple[str, ...]]:
    body = str(parts["PENDULUM"]).splitlines()
    body += [f"  log: {_quoted(_from(folder, log.path))}", "  channels:"]
    undecided = []
    for channel in ("time", *swings):
        body += ["  " + line for line in _line(channel, log.guesses[channel])]
        undecided += [f"unit of {channel}"] if log.guesses[channel].unit == "?" else []
    return body, ("time", *swings), tuple(undecided)


def _from(folder: Path, path: Path) -> str:
    """The path of a log relative to the description's folder."""
    return os.path.relpath(path.resolve(), folder.resolve())


def _marked(text: str) -> list[str]:
    """Marked keys outside the channels."""
    return [line.split(":")[0].strip(" -") for line in text.splitlines() if ': "?"' in line and "column" not in line]
