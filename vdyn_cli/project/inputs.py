"""Gathering one test's inputs: its description, its logs, and the parameters already known. Reads files."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np

from vdyn_cli.description.spec_errors import check_channels
from vdyn_cli.description.spec_loading import load_partial
from vdyn_cli.description.test_description import Channel, Environment, Logger, Run, TestSpec, Vehicle
from vdyn_cli.description.yaml_source import Location, YamlSource, load_yaml
from vdyn_cli.effects import candidates, extensions_in_si, refused
from vdyn_cli.io.align import AlignOn, merge
from vdyn_cli.io.block_means import condensed, condensing_note
from vdyn_cli.io.file_units import unit_problem
from vdyn_cli.io.held_values import without_held
from vdyn_cli.io.log_formats import read_log
from vdyn_cli.io.quality.cross_checks import with_cross_checks
from vdyn_cli.io.quality.cuts import CutLog, CutOrders, TimeSpan, cut_findings, suspect_findings, with_cuts
from vdyn_cli.io.reader import Column, ReadOptions
from vdyn_cli.io.sample_times import impossible_clock
from vdyn_cli.io.unchanged import read_unchanged
from vdyn_cli.physics.laws.atmosphere import air_density
from vdyn_cli.project.channel_sources import (
    Scaling,
    channel_maps,
    completed,
    known_channels,
    logged,
    needed_channel,
    scalings,
    unused_sources,
)
from vdyn_cli.project.paired_logs import with_pair_doubts
from vdyn_cli.project.repeated_runs import repeated_runs
from vdyn_cli.project.road_profile import road_findings, survey_note, surveyed_road, with_grade
from vdyn_cli.project.run_parts import split_runs
from vdyn_cli.project.unlike_runs import other_units, with_run_signs
from vdyn_cli.project.unread_keys import contradictory_keys, unread_keys
from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.cut_ledger import DataQuality
from vdyn_cli.quantities.errors import (
    Finding,
    InputError,
    ResultError,
    did_you_mean,
    in_file_order,
    merge_logs,
    raise_all,
)
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.number_text import moment
from vdyn_cli.quantities.parameter_json import read_document
from vdyn_cli.quantities.parameters import Estimate, MissingParameterError, Parameters
from vdyn_cli.quantities.quality_flags import EVERY
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps import Step, names
from vdyn_cli.steps.road_survey import RoadSurvey

CONTRADICTS = 3.0  # standard deviations between a value of the description and one of a parameter file
SAME = 1e-3  # share by which such values may differ however well they are known
P = ParamSpec("P")
R = TypeVar("R")


def _same(log: Log) -> Log:
    return log


@dataclass(frozen=True)
class Inputs:
    """Everything a step's estimate reads, and the files it came from, with the sha256 of the bytes that were read.

    ``step`` is the one of the description's manoeuvre; ``scalings`` are the channels made from others; ``unsplit`` are
    the runs before long cuts split them; ``clocks`` are the differences of the loggers' clocks;
    ``road`` is the survey that gave the grade.
    """

    step: Step
    spec: Any
    source: YamlSource
    data: Any
    logs: tuple[Log, ...]
    known: Parameters
    files: Mapping[Path, str]
    findings: tuple[Finding, ...] = ()
    scalings: tuple[Scaling, ...] = ()
    cut: tuple[CutLog, ...] = ()
    ready: Callable[[Log], Log] = _same
    unsplit: tuple[CutLog, ...] = ()
    clocks: tuple[ClockDifference, ...] = ()
    road: RoadSurvey | None = None

    def data_with(self, logs: tuple[Log, ...]) -> Any:
        """What the step reads, with other logs in the place of those that were read."""
        used, _ = condensed_logs(logs, self.step.rate(self.spec))
        return used if self.step.load is None else self.step.load(self.spec, self.source.path.parent, used)[0]

    @property
    def quality(self) -> DataQuality:
        """The quality of all logs, and the ledger of their cuts."""
        channels = {one.log.name: {n: one.flags.counts(n) for n in one.flags.states} for one in self.cut}
        rows = {id(row): row for one in self.cut for row in one.ledger}  # parts of one run share theirs
        return DataQuality(
            channels, tuple(rows.values()), self.clocks, None if self.road is None else self.road.summary()
        )


def gather(step: Step, path: Path, known_files: Iterable[Path] = ()) -> Inputs:
    """Read a test's description and all that it refers to, reporting every problem at once.

    What is wrong in the description is left out of it, so that the logs are checked all the same.

    Raises
    ------
    InputError : whatever is wrong in the description, the logs or the parameter files.
    """
    refuse_other_test(step, path)
    described = load_partial(path, step.spec)
    spec, source, problems = described.spec, described.source, list(described.problems)
    if spec is None:
        raise InputError(*in_file_order([*problems, *missing_logs(source)], source.path.name))
    step, known_files = step.of(spec), tuple(known_files)
    unreadable = wrong_channels(step, spec, source, described.dropped)
    problems += [*unreadable, *contradictory_keys(spec, source), *wrong_effects(step, spec, source)]
    problems += [*_repeated(spec, source), *_wrong_segments(spec, source)]
    stated = given_parameters(spec.vehicle).updated(given_air(spec.environment))
    known, files = stated, dict(source.digests)
    for file in known_files:
        if (later := attempt(problems, read_known, file)) is not None:
            known, files[file] = known.updated(later[0]), later[1]
    before = len(problems)
    constants = known_channels(step, spec, source, problems)
    made = attempt(problems, scalings, step, spec, known) or ()
    road = attempt(problems, surveyed_road, spec, source, files)
    unreadable += problems[before:]
    read = [attempt(problems, _read_run, step, spec, source, i, files) for i in range(len(spec.runs))]
    ready = partial(_ready, step, constants, made, road)
    clocks = tuple(clock for one in read if one is not None for clock in one[1])
    cut = tuple(replace(one[0], log=ready(one[0].log)) for one in read if one is not None)
    if not unreadable:
        cut = tuple(one for one in cut if attempt(problems, _within_physics, step, one.log) is not None)
    cut = with_pair_doubts(clocks, cut)
    logs = tuple(one.log for one in cut)
    places = [source.where(("runs", i)) for i, one in enumerate(read) if one is not None]
    problems += repeated_runs(logs, places) if len(places) == len(logs) else []
    problems += [*other_units(logs), *road_findings(road, spec, logs)] if not unreadable else []
    unsplit = cut
    there = [run for run, one in zip(spec.runs, read, strict=True) if one is not None]
    if len(logs) == len(spec.runs):
        spec, cut = split_runs(step, spec, cut, ready)
        logs, there = tuple(one.log for one in cut), spec.runs
    used, condensing = condensed_logs(logs, step.rate(spec))
    data: Any = used if step.load is None else None
    if step.load is not None and not unreadable:
        extra = attempt(problems, read_unchanged, partial(step.load, spec, path.parent, used))
        if extra is not None:
            data, own_files = extra
            files |= own_files
    if problems:
        if data is not None and not unreadable and _usable(described.dropped, step) and 0 < len(logs) == len(there):
            found: list[Finding] = []
            attempt(found, _prepared, step, spec.model_copy(update={"runs": there}), data, known, source)
            problems += [f for f in found if not _of_dropped(f, described.dropped) and f not in problems]
        names = [name for run in spec.runs for name in _log_names(run)]
        raise InputError(*in_file_order(merge_logs(with_run_signs(problems, logs), names), source.path.name))
    findings = (*_overruled(stated, known, source), *unused_sources(step, spec, source), *(s.note() for s in made))
    findings += (*unread_keys(step, spec, source), *survey_note(road))
    findings += (*condensing, *(refused() if step.diagnosable else ()))
    return Inputs(step, spec, source, data, logs, known, files, findings, made, cut, ready, unsplit, clocks, road)


def _usable(dropped: Iterable[Location], step: Step) -> bool:
    """Whether a description without what is wrong in it still says which numbers its step lacks."""
    needed = step.spec.model_fields.keys() - {"title", "diagnose", "reading", "environment", "settings"}
    return all(at[0] not in needed for at in dropped)


def _of_dropped(finding: Finding, dropped: Iterable[Location]) -> bool:
    """Whether a finding misses what a wrong key would have given, which is reported already."""
    names = {str(at[1]) for at in dropped if len(at) > 1 and at[0] in ("environment", "vehicle")}
    names |= {"air_density"} if names & {"temperature", "pressure", "humidity"} else set()
    return any(finding.what.startswith(f"{n} (") for n in names)


def _prepared(step: Step, spec: TestSpec, data: Any, known: Parameters, source: YamlSource) -> None:
    """Prepare the step, so that what it lacks is reported together with everything else."""
    with suppress(ResultError), at_vehicle(step, source):
        step.prepare(spec, data, known)


@contextmanager
def at_vehicle(step: Step, source: YamlSource) -> Iterator[None]:
    """Report a parameter that a step misses at the vehicle of the description, and not at the step's name."""
    try:
        yield
    except MissingParameterError as error:
        place = source.where(("vehicle",))
        found = (replace(f, where=place) if f.where == step.name else f for f in error.findings)
        raise MissingParameterError(*found) from None


def missing_logs(source: YamlSource) -> list[Finding]:
    """The logs that do not exist, of a description that is no description."""
    runs = source.data.get("runs") if isinstance(source.data, dict) else None
    found = []
    for i, run in enumerate(runs if isinstance(runs, list) else ()):
        named = [run.get("log"), *(run.get("logs") or [])] if isinstance(run, dict) else []
        for name in named:
            if isinstance(name, str) and not (source.path.parent / name).exists():
                found.append(Finding(source.where(("runs", i)), f"the log {name} does not exist"))
    return found


def read_known(file: Path) -> tuple[Parameters, str]:
    """The parameters of a ``--known`` file, the effects among them in SI, and the sha256 of the file."""
    problems: list[Finding] = []
    read = read_document(file)
    extensions = extensions_in_si(read.parameters.extensions, str(file), problems)
    raise_all(problems)
    return replace(read.parameters, extensions=extensions), read.digest


def _overruled(stated: Parameters, known: Parameters, source: YamlSource) -> Iterator[Finding]:
    """Values of the description that a parameter file contradicts, and that are not used."""
    for name, given in stated.estimates.items():
        used = known[name]
        apart, spread = abs(given.value - used.value), float(np.hypot(given.std, used.std))
        if apart > max(CONTRADICTS * spread, SAME * abs(given.value)):
            what = f"{name} = {given.value:.5g} is not used: a parameter file gives {used.value:.5g}"
            distance = f", {apart / spread:.0f} standard deviations off" if spread > 0 else ""
            yield Finding(
                source.where(("vehicle", name)), what + distance, "", "remove it from one of them", doubt=True
            )


def attempt(problems: list[Finding], call: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R | None:
    """Call, keeping what is wrong for one report at the end."""
    try:
        return call(*args, **kwargs)
    except InputError as error:
        problems.extend(f for f in error.findings if f not in problems)
        return None


def condensed_logs(logs: tuple[Log, ...], rate: float | None) -> tuple[tuple[Log, ...], tuple[Finding, ...]]:
    """The logs at the rate that the step needs, and a note where that averages any."""
    if rate is None:
        return logs, ()
    after = tuple(condensed(log, rate) for log in logs)
    return after, condensing_note(logs, after, rate)


def refuse_other_test(step: Step, path: Path) -> None:
    """Refuse the description of another step at once: by this step's keys every line of it is wrong."""
    source = load_yaml(path)
    test = source.data.get("test") if isinstance(source.data, dict) else None
    if isinstance(test, str) and test != step.name:
        what = f"test type mismatch: this command needs 'test: {step.name}'"
        other = f"run 'vdyn {test} {path.name}', or correct the key 'test'"
        remedy = other if test in names() else f"write 'test: {step.name}'"
        raise InputError(Finding(source.where(("test",)), what, repr(test), remedy))


def wrong_channels(step: Step, spec: TestSpec, source: YamlSource, dropped: Collection[Location] = ()) -> list[Finding]:
    """Unknown channels, wrong units, and needed channels that no logger maps.

    Parameters
    ----------
    dropped : places of the description that are left out, since they are wrong.
    """
    known = step.channels()
    findings = check_channels(spec.channels, known, source, ("channels",))
    for i, logger in enumerate(spec.loggers):
        findings += check_channels(logger.channels, known, source, ("loggers", i, "channels"))
    for channels, at in channel_maps(spec):
        columns = {n: _column(known[n], c, source, (*at, n)) for n, c in logged(channels).items() if n in known}
        findings += [f for c in columns.values() if (f := unit_problem(c, source.path.name)) is not None]
    if not spec.runs:
        return findings
    for channels, at in channel_maps(spec):
        if "time" in channels and "time" not in logged(channels):
            place = source.where((*at, "time"))
            findings.append(Finding(place, "the clock cannot be a constant", "", "write its column and unit"))
    mapped = {n for channels, _ in channel_maps(spec) for n in channels}
    mapped |= {str(at[-1]) for at in dropped if at[:-1] and at[-2] == "channels"}
    mapped |= set(known) if ("channels",) in dropped or ("loggers",) in dropped else set()
    mapped |= {one.target for one in step.scaled if one.source in mapped}
    place = source.where(("loggers",) if spec.loggers else ("channels",))
    for entry in step.required:
        ways = [way.split("+") for way in entry.split("|")]
        if not any(set(way) <= mapped for way in ways):
            names = " or ".join(" + ".join(way) for way in ways)
            quantity = known[ways[0][0]]
            line = f"{ways[0][0]}: {{column: '<header>', unit: {quantity.unit or '1'}}}"
            remedy = f"add '{line}' to the channels{needed_channel(step, ways[0])}"
            findings.append(Finding(place, f"channel {names} is needed", remedy=remedy))
    return findings


def wrong_effects(step: Step, spec: TestSpec, source: YamlSource) -> Iterator[Finding]:
    """Effects to look for, or to extend the model by, that are no candidates of this step, are listed twice, or are to
    extend the model and are not looked for."""
    requested = spec.diagnose
    for key in ("effects", "extend"):
        named = getattr(requested, key)
        names = named if isinstance(named, list) else []
        known = [e.name for e in candidates(step.situations)] if names else []
        for i, name in enumerate(names):
            what, remedy = "", ""
            if name not in known:
                what, remedy = f"not a candidate effect for '{step.name}'", did_you_mean(name, known, _there_are(known))
            elif name in names[:i]:
                what, remedy = "is listed twice", "remove one"
            elif key == "extend" and isinstance(requested.effects, list) and name not in requested.effects:
                what, remedy = "is not in diagnose.effects, so it is not tested", "add it there"
            if what:
                yield Finding(source.where(("diagnose", key, i)), f"'diagnose.{key}': {what}", name, remedy)


def _there_are(names: Iterable[str]) -> str:
    return f"there are {', '.join(names)}"


def _repeated(spec: TestSpec, source: YamlSource) -> list[Finding]:
    """Runs whose time windows in the same log overlap: they would count as independent evidence."""
    seen: dict[tuple[str, ...], list[tuple[float, float, int]]] = {}
    findings = []
    for i, run in enumerate(spec.runs):
        start = run.from_time.value if run.from_time else -np.inf
        stop = run.to_time.value if run.to_time else np.inf
        columns = (f"{channel}: {column}" for channel, column in sorted(run.columns.items()))
        others = seen.setdefault((*map(os.path.normpath, _log_names(run)), *columns), [])
        for first, last, k in others:
            if min(stop, last) > max(start, first):
                same = (start, stop) == (first, last)
                what = "the same log is listed twice" if same else "the time window overlaps that of another run"
                got = f"{_log_names(run)[0]}, first at {source.where(('runs', k))}"
                findings.append(Finding(source.where(("runs", i)), what, got))
                break
        others.append((start, stop, i))
    return findings


def _log_names(run: Run) -> list[str]:
    return [run.log] if run.log is not None else list(run.logs or [])


def _read_run(
    step: Step, spec: TestSpec, source: YamlSource, index: int, files: dict[Path, str]
) -> tuple[CutLog, tuple[ClockDifference, ...]]:
    """One run's log, from one logger or merged from several, cut to its window; enters its files with their sha256."""
    run = spec.runs[index]
    names = _log_names(run)
    loggers = spec.loggers or [Logger(channels=spec.channels, reading=spec.reading)]
    place = source.where(("runs", index))
    if len(names) != len(loggers):
        remedy = "give one log per entry of 'loggers', in the same order"
        raise InputError(Finding(place, f"{len(loggers)} logs are needed", f"{len(names)}", remedy))
    problems = [f for key in ("columns", "signs") for f in _unmapped(run, spec, source, ("runs", index, key))]
    read, no_unit, units = [], set[str](), dict[str, str]()
    for name, logger, (channels, at) in zip(names, loggers, channel_maps(spec), strict=True):
        mapped = logged(channels)
        mapped |= {n: c.model_copy(update={"column": run.columns[n]}) for n, c in mapped.items() if n in run.columns}
        mapped |= {n: c.model_copy(update={"sign": c.sign * run.signs[n]}) for n, c in mapped.items() if n in run.signs}
        quantities = {n: q for n, q in step.channels().items() if n in mapped}
        columns = {n: _column(q, mapped[n], source, (*at, n)) for n, q in quantities.items()}
        wrong = {n for n, c in columns.items() if unit_problem(c, name) is not None}  # reported with the channels
        columns |= {n: replace(columns[n], unit=columns[n].si_unit) for n in wrong}
        no_unit |= wrong
        units |= {n: c.unit for n, c in columns.items()}
        options = ReadOptions(**logger.reading.model_dump())
        called = f"{name} ({', '.join(run.columns.values())})" if run.columns else name
        file = source.path.parent / name
        if "time" not in columns:  # reported with the channels
            problems += [] if file.exists() else [Finding(place, f"the log {name} does not exist")]
            continue
        reader = partial(_log_and_file, file, columns, options, called)
        read.append(attempt(problems, read_unchanged, reader, (file,)))
    raise_all(problems)
    logs = [one[0] for one in read if one is not None]
    if len(logs) < len(loggers):
        raise InputError()
    for one in read:
        files |= one[1] if one is not None else {}
    delays = [logger.delay for logger in loggers[1:]]
    log, clocks = (logs[0], ()) if len(logs) == 1 else merge(logs[0], logs[1:], _align_on(spec), delays)
    found = with_cuts(log, replace(_cut_orders(run), units={n: u for n, u in units.items() if n in log}))
    found = _in_window(run, found, place)
    # Where a torque drives the vehicle, it tells which of two channels has the wrong scale.
    log = replace(found.log, findings=(*found.log.findings, *cut_findings(found.ledger), *suspect_findings(found)))
    log = _summed(step, _within_physics(step, log, no_unit))
    tilts = getattr(getattr(spec, "settings", None), "accelerometer", None) == "body"
    log = log if no_unit else with_cross_checks(log, refuse="driving" not in step.situations, tilts=tilts)
    return replace(found, log=log), clocks


def _in_window(run: Run, found: CutLog, place: str) -> CutLog:
    """The part of a run between from_time and to_time, which stand on the log's clock.

    Raises
    ------
    InputError : a time that is meant from the begin of the log, whose clock begins later; a window without samples.
    """
    time, name = found.log.time, found.log.name
    first, last = float(time[0]), float(time[-1])
    start, stop = (g.value if g else end for g, end in ((run.from_time, first), (run.to_time, last)))
    for key, given, end in (("from_time", run.from_time, start), ("to_time", run.to_time, stop)):
        if given is not None and 0.0 < end < first - (last - first):
            what = f"'{key}' lies long before the clock of {name}, which begins at {moment(first)} s"
            remedy = f"count from there: '{key}: {moment(first + end)} s' is {moment(end)} s after its begin"
            raise InputError(Finding(place, what, f"{moment(end)} s", remedy))
    within = found if run.from_time is None and run.to_time is None else found.between(start, stop)
    if within is not found and within.log.time.size < 2:
        got = f"{moment(start)} s to {moment(stop)} s"
        remedy = f"choose it between {moment(first)} s and {moment(last)} s, on the clock of {name}"
        raise InputError(Finding(place, "the time window holds no samples of the log", got, remedy))
    return within


def _align_on(spec: TestSpec) -> AlignOn:
    return (spec.align_on[0], spec.align_on[1]) if isinstance(spec.align_on, list) else spec.align_on


def _unmapped(run: Run, spec: TestSpec, source: YamlSource, at: Location) -> list[Finding]:
    """Columns or signs of a run for channels that no logger maps, so that they would have no unit."""
    mapped = [n for channels, _ in channel_maps(spec) for n in logged(channels)]
    remedy = "map it, with its unit, under channels"
    return [
        Finding(source.where((*at, n)), f"channel '{n}' is not mapped", str(value), remedy)
        for n, value in getattr(run, str(at[-1])).items()
        if n not in mapped
    ]


def _log_and_file(
    file: Path, columns: Mapping[str, Column], options: ReadOptions, name: str
) -> tuple[Log, tuple[Path, ...]]:
    return read_log(file, columns, options, name), (file,)


def _ready(
    step: Step, constants: Mapping[str, float], made: Sequence[Scaling], road: RoadSurvey | None, log: Log
) -> Log:
    """The log with held channels joined, its constant channels, those made from others, totals, the surveyed grade."""
    return with_grade(_summed(step, completed(without_held(log), constants, made)), road)


def _wrong_segments(spec: TestSpec, source: YamlSource) -> Iterator[Finding]:
    """Segments to cut or to keep of channels that no logger maps, or that end before they begin."""
    mapped = sorted({n for channels, _ in channel_maps(spec) for n in logged(channels)} - {"time"})
    for i, run in enumerate(spec.runs):
        for key, listed in (("cuts", run.cuts), ("keep", run.keep)):
            for k, one in enumerate(listed if isinstance(listed, list) else ()):
                place = source.where(("runs", i, key, k))
                if one.channel not in (EVERY, *mapped):
                    remedy = did_you_mean(one.channel, mapped, f"write {EVERY}, or one of {', '.join(mapped)}")
                    yield Finding(place, f"'{key}': channel '{one.channel}' is not mapped", remedy=remedy)
                elif one.stop.value < one.start.value:
                    got = f"from {one.start.value:g} s to {one.stop.value:g} s"
                    yield Finding(place, f"'{key}': the segment ends before it begins", got)


def _cut_orders(run: Run) -> CutOrders:
    """What the description says about cuts in this run."""
    listed = run.cuts if isinstance(run.cuts, list) else []
    cut, kept = (tuple(TimeSpan(s.channel, s.start.value, s.stop.value) for s in group) for group in (listed, run.keep))
    return CutOrders(run.cuts == "automatic", cut, kept)


def _within_physics(step: Step, log: Log, no_unit: Collection[str] = ()) -> Log:
    """The log, unless its clock or a channel is that of no vehicle: then its unit is likely another one.

    Parameters
    ----------
    no_unit : channels whose unit is not known, so that they are not checked.

    Raises
    ------
    InputError : an impossible clock, or a hundredth of a channel's samples or more outside its physical range; all
        channels at once.
    """
    problems = list(impossible_clock(log))
    for name, quantity in step.channels().items():
        values = log[name] if name in log and name != "time" and name not in no_unit else None
        if values is None or not np.isfinite(values).any():
            continue
        outside = (values < quantity.lower) | (values > quantity.upper)
        if np.mean(outside) > 0.01 or np.nanmax(np.abs(values)) > 1e12:
            worst = values[np.nanargmax(np.abs(values))]
            span = f"{quantity.lower:g} to {quantity.upper:g} {quantity.unit}".strip()
            got = f"{worst:.4g} {quantity.unit}".strip()
            remedy = "check the unit and the column of this channel"
            problems.append(Finding(f"{log.name}, channel '{name}'", f"lies outside {span}", got, remedy))
    raise_all(problems)
    return log


def _column(quantity: Quantity, channel: Channel, source: YamlSource, at: Location) -> Column:
    place = source.where(at)
    unit, sign, group = channel.unit, channel.sign, channel.group
    return Column(channel.column, unit, quantity.unit, sign, False, place, group, channel.source, channel.scale)


def _summed(step: Step, log: Log) -> Log:
    """The log with totals made of mapped parts: ``front_load|front_left_load+front_right_load``."""
    for entry in (*step.required, *step.optional):
        total, *alternatives = entry.split("|")
        for way in alternatives:
            parts = way.split("+")
            if total not in log and all(part in log for part in parts):
                log = log.with_channels(**{total: sum(log[part] for part in parts)})
    return log


def given_parameters(vehicle: Vehicle) -> Parameters:
    """What the description states of the vehicle."""
    return Parameters({name: Estimate.given(PARAMETERS[name], g.value, g.std) for name, g in vehicle.items()})


def given_air(air: Environment) -> Parameters:
    """What the description states of the air; its density where temperature and pressure are both there."""
    stated = {"temperature": air.temperature, "pressure": air.pressure}
    estimates = {n: Estimate.given(PARAMETERS[n], g.value, g.std) for n, g in stated.items() if g is not None}
    if air.temperature is not None and air.pressure is not None:
        humidity = air.humidity.value if air.humidity else 0.0
        density = air_density(air.temperature.value, air.pressure.value, humidity)
        estimates["air_density"] = Estimate.given(PARAMETERS["air_density"], density)
    return Parameters(estimates)
