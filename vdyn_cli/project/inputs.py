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
from vdyn_cli.project.checks.logged_conditions import contradicted_conditions
from vdyn_cli.project.checks.run_comparison import compare_runs
from vdyn_cli.project.checks.run_unit_checks import with_run_signs
from vdyn_cli.project.checks.unread_keys import contradictory_keys, unread_keys
from vdyn_cli.project.reading.channel_sources import (
    Scaling,
    unused_sources,
)
from vdyn_cli.project.reading.given_values import contradicted_values
from vdyn_cli.project.reading.left_out_runs import LeftOutRun, WrongRunsError
from vdyn_cli.project.reading.logger_columns import log_names
from vdyn_cli.project.reading.read_inputs import GivenValues, InputProblems, given_values, read_logs, ready_runs
from vdyn_cli.project.reading.road_profile import survey_note
from vdyn_cli.project.reading.run_parts import split_runs
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
    left_out : the runs of the description that are not among the others. contradicted : as of ``LoggedTest``.
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
    contradicted: tuple[Finding, ...] = ()

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


@dataclass(frozen=True, eq=False)
class LoggedTest:
    """A description and the logs of its runs, read before the results of earlier steps are known.

    Parameters
    ----------
    step : that of the description's manoeuvre. described : the description. kept : indices of the runs to read.
    problems : in both, and the files. read : log and clocks of the runs that can be read, by index among those kept.
    contradicted : stated directions and starts that the logs contradict, if all can be read.
    """

    step: Step
    described: PartialSpec[Any]
    kept: Sequence[int]
    problems: InputProblems
    read: Mapping[int, tuple[CutLog, tuple[ClockDifference, ...]]]
    contradicted: tuple[Finding, ...]


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

    Parameters
    ----------
    path : the description. known_files : parameter files, of which later ones have priority.
    left_out : indices of runs in the description that are not read.

    Raises
    ------
    WrongRunsError : with all problems, if only some of the runs have any.
    InputError : with all problems of the description, the logs and the parameter files.
    """
    return with_known(logged_test(step, path, left_out), tuple(known_files))


def logged_test(step: Step, path: Path, left_out: frozenset[int] = frozenset[int]()) -> LoggedTest:
    """Read a test's description and the logs of its runs.

    Wrong entries of the description are removed, so that the logs are checked nevertheless.

    Parameters
    ----------
    path : the description. left_out : indices of runs in the description that are not read.

    Raises
    ------
    InputError : the description cannot be read.
    """
    described, kept = _described(step, path, left_out)
    spec, source = described.spec, described.source
    assert spec is not None
    step = step.of(spec)
    problems = InputProblems(dict(source.digests), list(described.problems))
    _check_description(step, described, problems)
    read = read_logs(step, spec, source, problems)
    contradicted = contradicted_conditions(spec, source) if len(read) == len(spec.runs) else ()
    return LoggedTest(step, described, kept, problems, read, tuple(contradicted))


def with_known(test: LoggedTest, known_files: Sequence[Path]) -> Inputs:
    """The inputs of a test whose logs are read, with the parameters of earlier steps.

    Parameters
    ----------
    test : used once, since problems and files are added to its own. known_files : as for ``gather``.

    Raises
    ------
    WrongRunsError, InputError : as for ``gather``.
    """
    step, described, problems = test.step, test.described, test.problems
    spec, source = described.spec, described.source
    assert spec is not None
    values = given_values(step, spec, source, known_files, problems)
    runs = ready_runs(step, test.read, values.ready, problems)
    compare_runs(step, spec, source, runs, values, problems)
    wrong = () if problems.of_test else problems.of_runs.left_out(spec, source, runs.logs, test.kept)
    there, cut = spec.model_copy(update={"runs": [spec.runs[i] for i in runs.read]}), runs.cut
    if len(cut) == len(spec.runs):
        spec, cut = split_runs(step, spec, cut, values.ready)
        there = spec
    logs = tuple(one.log for one in cut)
    used, condensing = condensed_logs(logs, step.rate(spec))
    data = _loaded(step, spec, source.path.parent, used, problems)
    found = problems.all()
    if found:
        if data is not None and not problems.of_channels and 0 < len(logs) == len(there.runs):
            of_step = _of_step(step, there, data, values.known, described)
            found += [f for f in of_step if f not in found]
        names = [name for run in spec.runs for name in log_names(run)]
        merged = in_file_order(merge_logs(with_run_signs(found, logs, source), names), source.path.name)
        raise WrongRunsError(*merged, runs=wrong) if wrong else InputError(*merged)
    return Inputs(
        step, spec, source, data, logs, values.known, problems.files,
        findings=(*_notes(step, spec, source, values), *condensing, *(refused_effects() if step.diagnosable else ())),
        scalings=values.scalings, cut=cut, ready=values.ready, unsplit=runs.cut, clocks=runs.clocks, road=values.road,
        contradicted=test.contradicted,
    )  # fmt: skip


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


def _check_description(step: Step, described: PartialSpec[Any], problems: InputProblems) -> None:
    """Add what is wrong in the description alone."""
    spec, source = described.spec, described.source
    assert spec is not None
    problems.of_channels += wrong_channels(step, spec, source, described.dropped)
    problems.of_test += [*problems.of_channels, *contradictory_keys(spec, source), *wrong_effects(step, spec, source)]
    problems.of_test += [*repeated_entries(spec, source), *wrong_segments(spec, source)]


def _loaded(step: Step, spec: Description, folder: Path, logs: tuple[Log, ...], problems: InputProblems) -> Any:
    """The data for ``step.prepare``: the logs, or what the step loads beside them; None where that is impossible."""
    if step.load is None:
        return logs
    if problems.of_channels:
        return None
    loaded = attempt(problems.of_test, read_unchanged, partial(step.load, spec, folder, logs))
    if loaded is None:
        return None
    data, files = loaded
    problems.files |= files
    return data


def _notes(step: Step, spec: Description, source: YamlSource, values: GivenValues) -> tuple[Finding, ...]:
    """Notes on inputs without problems: values and keys that are not used, and computed channels."""
    unused = (*contradicted_values(values.stated, values.known, source), *unused_sources(step, spec, source))
    computed = (s.note() for s in values.scalings)
    return (*unused, *computed, *unread_keys(step, spec, source), *survey_note(values.road))


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
