"""Reading of one run of a test from its logs: on one clock, cut to its window, with totals and constants."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from vdyn_cli.description.description_model import OWN, Description, Logger, OwnKey, Run
from vdyn_cli.description.yaml_source import Location, YamlSource
from vdyn_cli.io.clocks.align import AlignOn, merge
from vdyn_cli.io.clocks.held_values import with_held_interpolated
from vdyn_cli.io.clocks.sample_times import impossible_clock
from vdyn_cli.io.file_units import wrong_units
from vdyn_cli.io.files import folder_error, remedy_for_missing_file
from vdyn_cli.io.fingerprinted_reading import read_unchanged
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.quality.channel_quality import WHOLE, Window
from vdyn_cli.io.quality.cross_checks import with_cross_checks
from vdyn_cli.io.quality.cuts import CutLog, CutOrders, TimeSpan, cut_findings, suspect_findings, with_cuts
from vdyn_cli.io.reader import Column, ReadOptions
from vdyn_cli.project.reading.channel_sources import (
    Scaling,
    channel_maps,
    logged_channels,
    readable_channels,
    with_known_channels,
)
from vdyn_cli.project.reading.logger_columns import at_log, log_names, logger_columns
from vdyn_cli.project.reading.road_profile import with_grade
from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.errors import Finding, InputError, attempt, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.number_text import moment
from vdyn_cli.steps import Step
from vdyn_cli.steps.road_survey import RoadSurvey
from vdyn_cli.steps.step_definition import alternative_channels


def read_run(
    step: Step, spec: Description, source: YamlSource, index: int, files: dict[Path, str]
) -> tuple[CutLog, tuple[ClockDifference, ...]]:
    """One run's log, from one logger or merged from several, cut to its window, and the differences of the clocks.

    Parameters
    ----------
    spec, source : the description, and its places for messages. index : of the run.
    files : to which the run's files are added, with their sha256.

    Raises
    ------
    InputError : with all problems of the run's logs.
    """
    run = spec.runs[index]
    names = log_names(run)
    loggers = spec.loggers or [Logger(channels=spec.channels, reading=spec.reading)]
    place = source.where(("runs", index))
    if len(names) != len(loggers):
        remedy = "give one log per entry of 'loggers', in the same order"
        remedy = remedy if spec.loggers else "list the loggers with their channels under 'loggers', or write one 'log'"
        needed = f"the run needs {'one log' if len(loggers) == 1 else f'{len(loggers)} logs'}"
        raise InputError(Finding(place, needed, f"{len(names)}", remedy))
    problems = [f for key in OWN for f in _unmapped(spec, source, index, key)]
    read, no_unit, units = [], set[str](), dict[str, str]()
    for k, (name, logger, nth) in enumerate(zip(names, loggers, run.recordings, strict=True)):
        found = logger_columns(readable_channels(step, spec), spec, source, index, k)
        problems += found.problems
        no_unit |= found.no_unit
        units |= {n: c.unit for n, c in found.columns.items()}
        file = source.path.parent / name
        if not os.path.exists(file):  # Path.exists raises for a folder without permission
            problems.append(Finding(place, f"the log {name} does not exist", "", remedy_for_missing_file(file)))
        elif os.path.isdir(file):
            (folder,) = folder_error(file, name).findings
            problems.append(replace(folder, where=place, what=f"the log {name} {folder.what}"))
        elif "time" in found.columns:  # else it is reported with the channels
            window = _window(run) if len(names) == 1 else WHOLE  # of the first logger's clock
            options = ReadOptions(**logger.reading.model_dump(), window=window, recording=nth)
            named = called(name, run, spec)
            reader = partial(_log_and_file, file, found.columns, options, named)
            read.append(attempt(problems, read_unchanged, reader, (file,)))
    raise_all(problems)
    logs = [one[0] for one in read if one is not None]
    if len(logs) < len(loggers):
        raise InputError()
    for one in read:
        files |= one[1] if one is not None else {}
    delays = [logger.delay for logger in loggers[1:]]
    log, clocks = (logs[0], ()) if len(logs) == 1 else merge(logs[0], logs[1:], _align_on(spec), delays)
    log = replace(log, channels={n: v for n, v in log.channels.items() if n in step.channels()})
    raise_all(_segments_outside(run, log, source, ("runs", index)))
    cut = with_cuts(log, replace(_cut_orders(run), units={n: u for n, u in units.items() if n in log}))
    return _checked(step, spec, _in_window(run, cut, place), no_unit), clocks


def called(name: str, run: Run, spec: Description) -> str:
    """What messages and results call a run's log: with the columns or times that distinguish it from another run's."""
    logger = log_names(run).index(name)
    columns = run.own("columns")[logger]
    if columns and sum(name in log_names(one) for one in spec.runs) > 1:
        return f"{name} ({', '.join(columns.values())})"
    number = run.recordings[logger]
    if number is not None:
        name = f"{name} (recording {number})"
    window = (run.from_time, run.to_time)
    same = (one for one in spec.runs if (log_names(one), one.recordings) == (log_names(run), run.recordings))
    if len(list(same)) == 1 or window == (None, None):
        return name
    start, stop = ("" if t is None else moment(t.value) for t in window)
    return f"{name} ({f'{start} to {stop}' if start and stop else f'from {start}' if start else f'to {stop}'} s)"


def tilts_with_body(spec: object) -> bool:
    """Whether a description states an accelerometer that pitches with the body."""
    return getattr(getattr(spec, "settings", None), "accelerometer", None) == "body"


def _checked(step: Step, spec: Description, found: CutLog, no_unit: Collection[str]) -> CutLog:
    """The run with its totals and the findings on its channels; channels in ``no_unit`` are not checked.

    Raises
    ------
    InputError : the clock or a channel is impossible for a vehicle.
    """
    log = replace(found.log, findings=(*found.log.findings, *cut_findings(found.ledger), *suspect_findings(found)))
    log = with_totals(step, within_physical_limits(step, log, no_unit))
    if not no_unit:
        # If a torque drives the vehicle, the fit can decide which of two channels has the wrong scale.
        log = with_cross_checks(log, refuse="driving" not in step.situations, tilts=tilts_with_body(spec))
    return replace(found, log=log)


def _in_window(run: Run, found: CutLog, place: str) -> CutLog:
    """The part of a run between from_time and to_time, which are times on the log's clock.

    Raises
    ------
    InputError : a time is counted from the beginning of a log whose clock does not start at zero, or the window has no
        samples.
    """
    time, name = found.log.time, found.log.name
    first, last = float(time[0]), float(time[-1])
    start, stop = (g.value if g else end for g, end in ((run.from_time, first), (run.to_time, last)))
    for key, given, end in (("from_time", run.from_time, start), ("to_time", run.to_time, stop)):
        if given is not None and 0.0 < end < first - (last - first):
            what = f"'{key}' is long before the clock of {name} starts, at {moment(first)} s"
            remedy = f"use the clock of the log: '{key}: {moment(first + end)} s' is {moment(end)} s after its start"
            raise InputError(Finding(place, what, f"{moment(end)} s", remedy))
    if run.from_time is not None and run.to_time is not None and start >= stop:
        what = f"'from_time' is not before 'to_time': the time window of {name} contains no samples"
        raise InputError(
            Finding(place, what, f"{moment(start)} s to {moment(stop)} s", "exchange them, or correct one")
        )
    within = found if run.from_time is None and run.to_time is None else found.between(start, stop)
    if within is not found and within.log.time.size < 2:
        stated = {"from_time": run.from_time, "to_time": run.to_time}
        got = ", ".join(f"{key}: {moment(g.value)} s" for key, g in stated.items() if g)
        what = f"the time window contains no samples of {name}, which spans {moment(first)} s to {moment(last)} s"
        raise InputError(Finding(place, what, got, "choose it within this span, on the log's clock"))
    return within


def _window(run: Run) -> Window:
    """The times between which a run is used, s on its log's clock."""
    start, stop = run.from_time, run.to_time
    return start.value if start else WHOLE[0], stop.value if stop else WHOLE[1]


def _align_on(spec: Description) -> AlignOn:
    return (spec.align_on[0], spec.align_on[1]) if isinstance(spec.align_on, list) else spec.align_on


def _unmapped(spec: Description, source: YamlSource, index: int, key: OwnKey) -> Iterator[Finding]:
    """Findings on columns, signs or units of a run for channels that the logger, or none of all loggers, maps."""
    maps = [logged_channels(channels) for channels, _ in channel_maps(spec)]
    run = spec.runs[index]
    listed = isinstance(getattr(run, key), list)
    for k, own in enumerate(run.own(key) if listed else run.own(key)[:1]):
        mapped = maps[k] if listed else {n for channels in maps for n in channels}
        for n, value in own.items():
            if n not in mapped:
                where = source.where((*at_log(("runs", index, key), run, k), n))
                what, remedy = f"channel '{n}' is not mapped", "map it, with its unit, under channels"
                yield Finding(where, what, str(value), remedy)


def _log_and_file(
    file: Path, columns: Mapping[str, Column], options: ReadOptions, name: str
) -> tuple[Log, tuple[Path, ...]]:
    return read_log(file, columns, options, name), (file,)


def ready_log(
    step: Step, constants: Mapping[str, float], made: Sequence[Scaling], road: RoadSurvey | None, log: Log
) -> Log:
    """The log with held channels interpolated, and constant channels, computed channels, totals and the grade added.

    Parameters
    ----------
    constants : SI value of each constant channel. made : computed channels. road : the road survey, or None.
    """
    return with_grade(with_totals(step, with_known_channels(with_held_interpolated(log), constants, made)), road)


def _cut_orders(run: Run) -> CutOrders:
    """The description's keys on cuts in this run."""
    listed = run.cuts if isinstance(run.cuts, list) else []
    cut, kept = (tuple(TimeSpan(s.channel, s.start.value, s.stop.value) for s in group) for group in (listed, run.keep))
    return CutOrders(run.cuts == "automatic", cut, kept)


def _segments_outside(run: Run, log: Log, source: YamlSource, at: Location) -> Iterator[Finding]:
    """Findings on segments to cut or keep that contain no sample of the run's log."""
    for key, listed in (("cuts", run.cuts), ("keep", run.keep)):
        for k, one in enumerate(listed if isinstance(listed, list) else ()):
            inside = np.searchsorted(log.time, one.stop.value, "right") - np.searchsorted(log.time, one.start.value)
            if inside < 1 and one.start.value <= one.stop.value:  # else reported with the description
                what = f"'{key}': the segment contains no sample of {log.name}"
                got = f"{moment(one.start.value)} s to {moment(one.stop.value)} s"
                remedy = f"write a time between {moment(log.time[0])} s and {moment(log.time[-1])} s"
                yield Finding(source.where((*at, key, k)), what, got, remedy)


def within_physical_limits(step: Step, log: Log, no_unit: Collection[str] = ()) -> Log:
    """The log, if its clock and channels are possible for a vehicle; otherwise a unit is probably wrong.

    A channel whose gain the step's diagnosis finds may exceed its range by that gain; a finding of the log states it.

    Parameters
    ----------
    no_unit : channels with an unknown unit, which are not checked.

    Raises
    ------
    InputError : the clock is impossible, or more than 1 % of a channel's samples are outside its physical range; all
        channels are reported at once.
    """
    problems, doubts = list(impossible_clock(log, step.longest_step)), list[Finding]()
    for name, quantity in step.channels().items():
        values = log[name] if name in log and name != "time" and name not in no_unit else None
        if values is None or not np.isfinite(values).any():
            continue
        outside = (values < quantity.lower) | (values > quantity.upper)
        if np.mean(outside) > 0.01 or np.nanmax(np.abs(values)) > 1e12:
            worst = values[np.nanargmax(np.abs(values))]
            got = f"{worst:.4g} {quantity.unit}".strip()
            negated = np.mean((-values < quantity.lower) | (-values > quantity.upper)) <= 0.01
            sign = f"the sign ('signs: {{{name}: -1}}' at the run), " if negated else ""
            remedy = f"check {sign}the unit and the column of this channel"
            most = step.any_gain.get(name, 1.0)
            far = np.mean((values < most * quantity.lower) | (values > most * quantity.upper)) > 0.01
            found = problems if far or most == 1.0 else doubts
            where, what = f"{log.name}, channel '{name}'", f"lies outside {quantity.range_text}"
            unit = next((f for f in wrong_units(log.findings) if f.channel == name), None)
            one = Finding(where, what, got, remedy, doubt=found is doubts)
            found.append(one if unit is None else replace(unit, what=f"{unit.what}; so read, it {what}", got=got))
    raise_all(problems)
    return replace(log, findings=(*log.findings, *doubts)) if doubts else log


def with_totals(step: Step, log: Log) -> Log:
    """The log with totals summed from mapped parts, such as ``front_load|front_left_load+front_right_load``."""
    for entry in (*step.required, *step.optional):
        (total, *_), *ways = alternative_channels(entry)
        for parts in ways:
            if total not in log and all(part in log for part in parts):
                log = log.with_channels(**{total: sum(log[part] for part in parts)})
    return log
