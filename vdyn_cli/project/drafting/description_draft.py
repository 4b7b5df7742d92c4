"""A first description of unknown logs: guessed channels with reasons, and a mark at every key left to the user."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from vdyn_cli.io.channel_survey import ChannelFacts, survey, without_clock
from vdyn_cli.io.files import distinct_names
from vdyn_cli.io.reader import is_clock
from vdyn_cli.project.drafting.channel_guess import ChannelGuess, guess_channels, without_unit
from vdyn_cli.project.drafting.drafted_channels import channel_line, quoted
from vdyn_cli.project.drafting.drafted_runs import relative_path, runs_of_loggers, runs_of_one_logger
from vdyn_cli.project.drafting.left_out_logs import GuessedLog, are_drives
from vdyn_cli.project.drafting.logger_runs import in_driven_order, logger_runs, unmatched
from vdyn_cli.project.drafting.run_conditions import air_during, run_conditions
from vdyn_cli.project.drafting.run_direction import LoggedDirection, logged_directions, named_directions
from vdyn_cli.project.drafting.station_log import StationLog, is_station, station_log
from vdyn_cli.project.drafting.units_by_place import with_units_by_place
from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.vocabulary import CHANNELS
from vdyn_cli.steps import Step
from vdyn_cli.steps.step_definition import named_channels

_UNMATCHED = (
    "the logs look like those of several loggers, but neither their clocks nor their names show",
    "which of them belong to one run: give the files of a run the same number, such as can_1.csv and gps_1.csv,",
    "and run init again",
)
_HEAD = "# A first description by 'vdyn init'. \"?\" marks values that the logs do not contain: write them there."


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
    for name, own in parts.get("MANOEUVRES", {}).items():
        other = step.manoeuvres[name]
        if logs and _shows_other(step, other, logs):
            step, parts = other, {**{k: v for k, v in parts.items() if k not in ("DRAFT", "RUN")}, **own}
    swings = [c for c in parts.get("PENDULUM_CHANNELS", ()) if logs[0].guesses[c].facts is not None]
    head = [_HEAD, f"test: {step.name}"]
    if swings and not _decided(step, logs[0]):
        body, mapped, undecided = _pendulum(logs[0], swings[:1], parts, folder)
    else:
        runs, parts, station = _with_station(logs, parts)
        body, mapped, undecided = _drives(step, in_driven_order(runs), parts, station, folder)
    body += [f"# left out: {f.where}, {f.what}" for f in problems]
    text = "\n".join([*head, *body]) + "\n"
    left = re.findall(r'^\s*# (?:- \{log: "(.+?)"[^}]*\}  # )?left out: (?:(.+?),)?', text, re.MULTILINE)
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
    body += parts["table_draft"](tables, [relative_path(folder, path) for path in tables])
    others = [log.name for log in logs if station is None or log is not stations[0]]
    body += [f"# {note}"] if note else []
    body += [f"# left out: {name}, is a log, not a table of runs: describe it in a separate file" for name in others]
    text = "\n".join([_HEAD, f"test: {step.name}", *body]) + "\n"
    open_ones = {'unit: "?"': "unit of speed", 'direction: "?"': "direction of each run"}
    undecided = (*(key for mark, key in open_ones.items() if mark in text), *_marked(text))
    return DescriptionDraft(text, ("time", "speed"), undecided, tuple(others))


def _read(step: Step, paths: Sequence[Path]) -> tuple[list[GuessedLog], list[Finding]]:
    wanted = dict(step.channels())
    wanted |= {c: CHANNELS[c] for c in _parts(step).get("PENDULUM_CHANNELS", ())}
    for name in _parts(step).get("MANOEUVRES", ()):
        wanted |= step.manoeuvres[name].channels()
    logs: list[GuessedLog] = []
    clockless: list[GuessedLog] = []
    problems: list[Finding] = []
    for path, name in distinct_names(paths).items():
        try:
            facts = survey(path)
        except InputError as error:
            problems += [f.renamed(path.name or name, name) for f in error.findings]
            continue
        parts = _parts(step)
        found = guess_channels(wanted, facts, path.name, parts.get("SECOND_CHOICE"))
        if "FALLING" in parts and len(facts) == 1 and facts[0].state == "varies":
            unit = found[parts["FALLING"]].unit or "?"
            found = {**found, parts["FALLING"]: ChannelGuess(facts[0], unit, "the only column of the file")}
        guesses = with_units_by_place(path, facts, found)
        guessed = GuessedLog(path, facts, guesses, name)
        if guessed.guesses["time"].facts is None:
            what, remedy = without_clock(facts)
            if not any(is_clock(f.info.name) for f in facts) and _decided(step, guessed):
                clockless.append(guessed)
            problems.append(Finding(name, f"is not a log: {what}", remedy=remedy))
            continue
        if not any(f.state in ("varies", "constant") for f in facts):
            what = "no column but the time has values"
            problems.append(Finding(name, what, remedy="record it again, or leave it out"))
            continue
        logs.append(guessed)
    if clockless and len(clockless) == len(paths):  # they are read with a fixed rate
        return clockless, []
    return logs, problems


def _parts(step: Step) -> Mapping[str, Any]:
    """The definitions in the step's module ``draft``; empty for a step of another package."""
    name = f"vdyn_cli.steps.{step.name}.draft"
    try:
        return vars(import_module(name)) if find_spec(name) else {}
    except ModuleNotFoundError:
        return {}


def _decided(step: Step, log: GuessedLog) -> bool:
    """Whether any required channel other than the time is found; any channel if the step requires none."""
    needed = [entry for entry in step.required if entry != "time"] or step.optional
    return any(part in log.columns() for entry in needed for part in named_channels(entry))


def _shows_other(step: Step, other: Step, logs: Sequence[GuessedLog]) -> bool:
    """Whether the logs have channels of another manoeuvre of a step, and none that only the step's usual one reads."""
    read, others = ({c for e in (*s.required, *s.optional) for c in named_channels(e)} for s in (step, other))
    found = {c for log in logs for c in log.columns()}
    return not found & (read - others) and bool(found & (others - {"time"}))


def _with_station(
    logs: Sequence[GuessedLog], parts: Mapping[str, Any]
) -> tuple[list[GuessedLog], Mapping[str, Any], StationLog | None]:
    """The logs of the runs, the step's parts, and the log of a weather station among them (None without one)."""
    stations = [log for log in logs if is_station(log.facts)] if "environment:" in parts.get("DRAFT", "") else []
    if not stations or len(stations) == len(logs):
        return list(logs), parts, None
    return [log for log in logs if log not in stations], parts, station_log(stations[0].path, stations[0].facts)


def _drives(
    step: Step, logs: Sequence[GuessedLog], parts: Mapping[str, Any], station: StationLog | None, folder: Path
) -> tuple[list[str], tuple[str, ...], tuple[str, ...]]:
    """Vehicle, channels and runs of a test with driven runs."""
    key = str(parts.get("RUN", ""))
    required = [n for entry in step.required for n in named_channels(entry)]
    notes = _UNMATCHED if unmatched(logs, required) else ()
    of_loggers = logger_runs(logs, required)
    if of_loggers and sum(len(log.columns()) > 1 for log in of_loggers[0]) > 1:  # not of a single logger with channels
        made = runs_of_loggers(step, logs, of_loggers, folder)
    else:
        made = runs_of_one_logger(step, logs, str(parts.get("FALLING", "")), parts.get("DRIVE", ()), folder)
    ways = _first_directions(made.facts, [log.path.name for log in made.kept]) if key.startswith("direction") else ()
    found = run_conditions([log.facts for log in made.kept], ways, station, step.run_keys or ())
    own = [log.window + keys + other for log, keys, other in zip(made.kept, found.keys, made.keys, strict=True)]
    runs, decided = _runs(made.entries, made.left_out, key, ways, own)
    body = [filled for line in parts.get("DRAFT", "").splitlines() for filled in _filled(line, found.air)]
    at = next((k + 1 for k, line in enumerate(body) if line.startswith("vehicle:")), 0)
    body[at:at] = _constants(step, parts, made.mapped, body)
    body += [*made.lines, "runs:", *(f"  # {note}" for note in (*notes, *found.notes)), *runs]
    undecided = list(made.undecided)
    if key and not key.startswith("side") and not decided:
        body.append(f"  # not decided by the logs, for each run: {key}")
        undecided += [f"{key.split(':')[0]} of each run"] if parts.get("RUN_NEEDED", True) else []
    choices = parts.get("ONE_OF", ())
    if choices and not any(set(way) <= set(made.mapped) for way in choices):
        undecided.append(" or ".join(" with ".join(way) for way in choices))
    driven = "DRIVE" in parts and are_drives(made.kept, parts["FALLING"], parts["DRIVE"], made.mapped)
    body += parts.get("SETTINGS_OF_DRIVES" if driven else "SETTINGS", "").splitlines()
    if "settings_of" in parts:
        body.append(parts["settings_of"](made.kept[0].columns() if made.kept else {}))
    return body, tuple(dict.fromkeys(made.mapped)), tuple(undecided)


def _constants(step: Step, parts: Mapping[str, Any], mapped: Sequence[str], body: Sequence[str]) -> list[str]:
    """The vehicle's constants that are needed for mapped channels, or to compute channels from others."""
    lines = [
        f"  {line}" for channel, own in parts.get("CONSTANTS_WITH", {}).items() if channel in mapped for line in own
    ]
    made = [one for one in step.scaled if one.source in mapped and one.target not in mapped]
    lines += [f'  {name}: "?"  # {one.equation}' for one in made for name in one.constants]
    by_key = {line.split(":")[0]: line for line in reversed(lines)}  # the first line of a key
    there = {line.split(":")[0] for line in body}
    return [line for key, line in reversed(by_key.items()) if key not in there]


def _filled(line: str, air: Sequence[tuple[str, str]]) -> list[str]:
    """A line of the environment with a station's values; the optional humidity follows the pressure."""
    own = [name for name in ("temperature", "pressure") if line.strip().startswith(f'{name}: "?"')]
    wanted = [*own, *(["humidity"] if own == ["pressure"] else [])]
    return [f"  {name}: {text}" for name, text in air if name in wanted] or [line]


def _first_directions(
    loggers: Sequence[Sequence[Sequence[ChannelFacts]]], names: Sequence[str]
) -> tuple[LoggedDirection, ...]:
    """The direction of each run from the first logger that shows any, else by the names of the logs."""
    found = [logged_directions(runs) for runs in loggers]
    by_name = named_directions(names)
    return next((ways for ways in (*found, by_name) if any(way.direction for way in ways)), found[0])


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
        side = f", direction: {way}" if way else f", {_named_side(entry, key)}" if key.startswith("side") else ""
        lines.append(f"  - {log}{side}{own[run]}}}{reason}")
        run += 1
    return lines, decided


def _named_side(entry: str, key: str) -> str:
    """The key of a run with the side that the names of its logs state; unchanged if they state none or both."""
    sides = without_unit(entry)[0] & {"left", "right"}
    return f"side: {next(iter(sides))}" if len(sides) == 1 else key


def _pendulum(
    log: GuessedLog, swings: Sequence[str], parts: Mapping[str, Any], folder: Path
) -> tuple[list[str], tuple[str, ...], tuple[str, ...]]:
    body = str(parts["PENDULUM"]).splitlines()
    body += [f"  log: {quoted(relative_path(folder, log.path))}", "  channels:"]
    undecided = []
    for channel in ("time", *swings):
        body += ["  " + line for line in channel_line(channel, log.guesses[channel])]
        undecided += [f"unit of {channel}"] if log.guesses[channel].unit == "?" else []
    return body, ("time", *swings), tuple(undecided)


def _marked(text: str) -> list[str]:
    """Marked keys outside the channels; those of the runs once."""
    lines = [line.strip() for line in text.splitlines() if "column" not in line]
    found = [(line, mark[1]) for line in lines if (mark := re.search(r'(\w+): "(?:[^"]* )?\?"', line))]
    return list(dict.fromkeys(f"{key} of each run" if line.startswith("- {") else key for line, key in found))
