"""The inputs of one test: its description, its logs, and known parameters. Reads files."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.spec_loading import PartialSpec, load_partial
from vdyn_cli.description.yaml_source import Location, YamlSource
from vdyn_cli.effects import refused_effects
from vdyn_cli.io.clocks.block_means import condensed, condensing_note
from vdyn_cli.io.fingerprinted_reading import read_unchanged
from vdyn_cli.io.quality.cuts import CutLog
from vdyn_cli.project.checks.description_checks import (
    missing_logs,
    refuse_other_test,
    repeated_entries,
    wrong_channels,
    wrong_effects,
    wrong_segments,
)
from vdyn_cli.project.checks.exchanged_columns import exchanged_columns
from vdyn_cli.project.checks.paired_logs import with_pair_warnings
from vdyn_cli.project.checks.repeated_runs import repeated_runs
from vdyn_cli.project.checks.run_unit_checks import contradicted_units, other_units, with_run_signs
from vdyn_cli.project.checks.speed_unit_checks import contradicted_speed
from vdyn_cli.project.checks.unread_keys import contradictory_keys, unread_keys
from vdyn_cli.project.reading.channel_sources import (
    Scaling,
    channel_maps,
    known_channels,
    logged_channels,
    scalings,
    unused_sources,
)
from vdyn_cli.project.reading.given_values import contradicted_values, given_air, given_parameters, read_known
from vdyn_cli.project.reading.left_out_runs import LeftOutRun, RunProblems, WrongRunsError
from vdyn_cli.project.reading.logger_columns import log_names
from vdyn_cli.project.reading.road_profile import road_findings, survey_note, surveyed_road
from vdyn_cli.project.reading.run_parts import split_runs
from vdyn_cli.project.reading.run_reading import read_run, ready_log, within_physical_limits
from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.data_quality import DataQuality
from vdyn_cli.quantities.errors import Finding, InputError, ResultError, attempt, in_file_order, merge_logs
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import MissingParameterError, Parameters
from vdyn_cli.steps import Step
from vdyn_cli.steps.road_survey import RoadSurvey


def _same(log: Log) -> Log:
    return log


@dataclass(frozen=True)
class Inputs:
    """All inputs of a step's estimate, and their files with the sha256 of the bytes that were read.

    Parameters
    ----------
    step : that of the description's manoeuvre. spec : the description, in SI. data : for ``step.prepare``.
    logs : of the runs, ready for the step and split at long cuts. cut : the same with their flags and cuts.
    unsplit : the runs before they were split. ready : adds constants, computed channels and the grade to a log.
    known : stated parameters and those of earlier steps. files : sha256 of each file that was read.
    findings : about the description and the relations of runs. scalings : the channels computed from others.
    clocks : differences of the loggers' clocks. road : survey that gives the grade.
    left_out : the runs of the description that are not among the others.
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
    left_out: tuple[LeftOutRun, ...] = ()

    def data_with(self, logs: tuple[Log, ...]) -> Any:
        """The data for ``step.prepare``, from other logs."""
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


def gather_usable(step: Step, path: Path, known_files: Iterable[Path] = ()) -> Inputs:
    """The inputs of the runs that can be used, where only single runs are wrong: unreadable or unlike the others.

    Parameters
    ----------
    path : the description. known_files : parameter files, of which later ones have priority.

    Raises
    ------
    InputError : as for ``gather``, if another problem remains, or no run.
    """
    known_files, left_out = tuple(known_files), list[LeftOutRun]()
    first: InputError | None = None
    while True:
        try:
            found = gather(step, path, known_files, frozenset(run.index for run in left_out))
            return replace(found, left_out=tuple(sorted(left_out, key=lambda run: run.index)))
        except WrongRunsError as error:
            left_out += error.runs
            first = first or error
        except InputError as error:
            raise first or error from None


def gather(
    step: Step, path: Path, known_files: Iterable[Path] = (), left_out: frozenset[int] = frozenset[int]()
) -> Inputs:
    """Read a test's description and all its files, and report all problems at once.

    Wrong entries of the description are removed, so that the logs are checked nevertheless.

    Parameters
    ----------
    path : the description. known_files : parameter files, of which later ones have priority.
    left_out : indices of runs in the description that are not read.

    Raises
    ------
    WrongRunsError : with all problems, if only some of the runs have any.
    InputError : with all problems of the description, the logs and the parameter files.
    """
    described, kept = _described(step, path, left_out)
    spec, source, problems = described.spec, described.source, list(described.problems)
    assert spec is not None
    step, known_files = step.of(spec), tuple(known_files)
    unreadable, repeats = wrong_channels(step, spec, source, described.dropped), repeated_entries(spec, source)
    problems += [*unreadable, *contradictory_keys(spec, source), *wrong_effects(step, spec, source)]
    problems += [*repeats, *wrong_segments(spec, source)]
    files = dict(source.digests)
    stated = given_parameters(spec.vehicle).updated(given_air(spec.environment))
    known = _with_files(stated, known_files, files, problems)
    before = len(problems)
    constants = known_channels(step, spec, source, problems)
    made = attempt(problems, scalings, step, spec, known) or ()
    road = attempt(problems, surveyed_road, spec, source, files)
    unreadable += problems[before:]
    apart, ready = RunProblems(), partial(ready_log, step, constants, made, road)
    read, clocks = _read_runs(step, described, apart, files)
    whole = {i: replace(one, log=ready(one.log)) for i, one in read.items()}
    if not unreadable:
        tested = {i: attempt(apart.of(i), within_physical_limits, step, one.log) for i, one in whole.items()}
        whole = {i: one for i, one in whole.items() if tested[i] is not None}
    cut = with_pair_warnings(clocks, tuple(whole.values()))
    logs = tuple(one.log for one in cut)
    if len(read) == len(logs) and not repeats:
        apart.compared.extend(repeated_runs(logs, [source.where(("runs", i)) for i in read]))
    if not unreadable:
        apart.compared.extend(_wrong_units(step, spec, logs))
        problems += [*road_findings(road, spec, logs), *_contradicted_speed(spec, source, logs, known)]
    wrong = () if problems else apart.left_out(spec, source, dict(zip(whole, logs, strict=True)), kept)
    problems += apart.all()
    unsplit = cut
    there = [spec.runs[i] for i in read]
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
        if data is not None and not unreadable and 0 < len(logs) == len(there):
            found = _of_step(step, spec.model_copy(update={"runs": there}), data, known, described)
            problems += [f for f in found if f not in problems]
        names = [name for run in spec.runs for name in log_names(run)]
        merged = in_file_order(merge_logs(with_run_signs(problems, logs, source), names), source.path.name)
        raise WrongRunsError(*merged, runs=wrong) if wrong else InputError(*merged)
    findings = (*contradicted_values(stated, known, source), *unused_sources(step, spec, source))
    findings += (*(s.note() for s in made), *unread_keys(step, spec, source), *survey_note(road))
    findings += (*condensing, *(refused_effects() if step.diagnosable else ()))
    return Inputs(step, spec, source, data, logs, known, files, findings, made, cut, ready, unsplit, clocks, road)


def _described(step: Step, path: Path, left_out: frozenset[int]) -> tuple[PartialSpec[Any], list[int]]:
    """The description without some of its runs, and the indices of the others.

    Raises
    ------
    InputError : the description cannot be read.
    """
    refuse_other_test(step, path)
    described = load_partial(path, step.spec)
    spec, source = described.spec, described.source
    if spec is None:
        raise InputError(*in_file_order([*described.problems, *missing_logs(source)], source.path.name))
    kept = [i for i in range(len(spec.runs)) if i not in left_out]
    if not left_out:
        return described, kept
    spec = spec.model_copy(update={"runs": [spec.runs[i] for i in kept]})
    return replace(described, spec=spec, source=source.without("runs", left_out)), kept


def _read_runs(
    step: Step, described: PartialSpec[Any], apart: RunProblems, files: dict[Path, str]
) -> tuple[dict[int, CutLog], tuple[ClockDifference, ...]]:
    """The runs that can be read, by index, and the differences of their clocks; their files are added to ``files``."""
    spec, source = described.spec, described.source
    assert spec is not None
    found = {i: attempt(apart.of(i), read_run, step, spec, source, i, files) for i in range(len(spec.runs))}
    read = {i: one for i, one in found.items() if one is not None}
    clocks = tuple(clock for _, differences in read.values() for clock in differences)
    apart.name_columns_at_runs(len(spec.runs))
    return {i: one for i, (one, _) in read.items()}, clocks


def _with_files(
    stated: Parameters, known_files: Sequence[Path], files: dict[Path, str], problems: list[Finding]
) -> Parameters:
    """The stated parameters, updated by parameter files, which are added to ``files`` with their sha256.

    A file's estimates take the place of stated values; its given values, which an earlier description stated, do not.
    """
    known = stated
    for file in known_files:
        if (later := attempt(problems, read_known, file)) is not None:
            older = [n for n, e in later[0].items() if e.source == "given" and n in stated]
            known, files[file] = known.updated(later[0].without(older)), later[1]
    return known


def _wrong_units(step: Step, spec: Description, logs: Sequence[Log]) -> tuple[Finding, ...]:
    """Problems of runs whose unit or column is another one than in the other runs; the first kind that is found."""
    if len(logs) != len(spec.runs):
        return tuple(other_units(logs))
    stated = tuple(contradicted_units(logs, spec.runs))
    return stated or _exchanged(step, spec, logs) or tuple(other_units(logs))


def _contradicted_speed(
    spec: Description, source: YamlSource, logs: Sequence[Log], known: Parameters
) -> Iterator[Finding]:
    """Problems of a unit that related channels contradict in all runs."""
    mapped = {
        n: (source.where((*at, n)), c.unit)
        for channels, at in channel_maps(spec)
        for n, c in logged_channels(channels).items()
    }
    return contradicted_speed(logs, [run.direction for run in spec.runs], known, mapped)


def _exchanged(step: Step, spec: Description, logs: Sequence[Log]) -> tuple[Finding, ...]:
    """Problems of runs with exchanged columns; only tested if each run has one log."""
    if spec.loggers or not spec.channels:
        return ()
    mapped, known = logged_channels(spec.channels), step.channels()
    columns = {n: (c.column, c.unit, known[n].unit) for n, c in mapped.items() if n in known}
    return tuple(exchanged_columns(logs, columns, [run.own("columns")[0] for run in spec.runs]))


def _usable(dropped: Iterable[Location], step: Step) -> bool:
    """Whether a description without its wrong entries still shows which parameters its step lacks."""
    needed = step.spec.model_fields.keys() - {"title", "diagnose", "reading", "environment", "settings"}
    return all(at[0] not in needed for at in dropped)


def _of_dropped(finding: Finding, dropped: Iterable[Location]) -> bool:
    """Whether a finding reports a missing value of a wrong key, which is reported already."""
    names = {str(at[1]) for at in dropped if len(at) > 1 and at[0] in ("environment", "vehicle")}
    names |= {"air_density"} if names & {"temperature", "pressure", "humidity"} else set()
    return any(finding.what.startswith(f"{n} (") for n in names)


def _of_step(step: Step, spec: Description, data: Any, known: Parameters, described: PartialSpec[Any]) -> list[Finding]:
    """Problems that the step finds when it is prepared, such as missing parameters; none without most of its keys."""
    found: list[Finding] = []
    if _usable(described.dropped, step):
        attempt(found, _prepared, step, spec, data, known, described.source)
    return [f for f in found if not _of_dropped(f, described.dropped)]


def _prepared(step: Step, spec: Description, data: Any, known: Parameters, source: YamlSource) -> None:
    with suppress(ResultError), errors_of_step(step, source, ()):
        step.prepare(spec, data, known)


def placed(finding: Finding, spec: Description, source: YamlSource, logs: Sequence[Log]) -> Finding:
    """The finding with file and line if its place is a key of the description, such as ``settings.step``.

    Parameters
    ----------
    source : of the description, with its lines. logs : whose names may be places, too.
    """
    if re.search(r":\d+$", finding.where):
        return finding
    location = tuple(finding.where.split("."))
    # A step or a log may be named like a key.
    another = finding.where == spec.test or finding.where.startswith(tuple(log.name for log in logs))
    if another or location[0] not in type(spec).model_fields:
        return finding
    return replace(finding, where=source.where(location), what=f"'{finding.where}': {finding.what}")


@contextmanager
def errors_of_step(step: Step, source: YamlSource, logs: Sequence[Log]) -> Iterator[None]:
    """Report a parameter that a step lacks at the line of ``vehicle`` in the description, not at the step's name, and
    a wrong sign with the remedy for the runs and the signs that the description states.

    Parameters
    ----------
    logs : of all runs.

    Raises
    ------
    InputError : of the same type, with the new findings.
    """
    try:
        yield
    except InputError as error:
        lacking, place = isinstance(error, MissingParameterError), source.where(("vehicle",))
        found = (replace(f, where=place) if lacking and f.where == step.name else f for f in error.findings)
        raise type(error)(*with_run_signs(tuple(found), logs, source)) from None


def condensed_logs(logs: tuple[Log, ...], rate: float | None) -> tuple[tuple[Log, ...], tuple[Finding, ...]]:
    """The logs averaged to ``rate``, Hz (None: unchanged), and a note if any was averaged."""
    if rate is None:
        return logs, ()
    after = tuple(condensed(log, rate) for log in logs)
    return after, condensing_note(logs, after, rate)
