"""What the description of a test states for all of its runs, and the runs that can be read. Reads files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.yaml_source import YamlSource
from vdyn_cli.io.quality.cuts import CutLog
from vdyn_cli.project.checks.paired_logs import with_pair_warnings
from vdyn_cli.project.reading.channel_sources import Scaling, known_channels, scalings
from vdyn_cli.project.reading.given_values import given_air, given_parameters, read_known
from vdyn_cli.project.reading.left_out_runs import RunProblems
from vdyn_cli.project.reading.road_profile import surveyed_road
from vdyn_cli.project.reading.run_reading import read_run, ready_log, within_physical_limits
from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.errors import Finding, attempt
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps import Step
from vdyn_cli.steps.road_survey import RoadSurvey


@dataclass
class InputProblems:
    """The files that were read, with their sha256, and the problems that were found in them so far.

    Parameters
    ----------
    of_test : not of single runs. of_channels : those of them without which the channels' values cannot be judged.
    """

    files: dict[Path, str]
    of_test: list[Finding]
    of_channels: list[Finding] = field(default_factory=list)
    of_runs: RunProblems = field(default_factory=RunProblems)

    def all(self) -> list[Finding]:
        """Every problem, those of the whole test first."""
        return [*self.of_test, *self.of_runs.all()]


@dataclass(frozen=True)
class GivenValues:
    """What the description states for all runs.

    Parameters
    ----------
    stated, known : parameters of the description; the same with those of earlier steps. Others: as of ``Inputs``.
    """

    stated: Parameters
    known: Parameters
    scalings: tuple[Scaling, ...]
    road: RoadSurvey | None
    ready: Callable[[Log], Log]


@dataclass(frozen=True)
class ReadRuns:
    """The runs that could be read.

    Parameters
    ----------
    read : their indices. logs : by index, those with possible values. cut : of these, with flags and cuts.
    clocks : differences of the loggers' clocks.
    """

    read: tuple[int, ...]
    logs: Mapping[int, Log]
    cut: tuple[CutLog, ...]
    clocks: tuple[ClockDifference, ...]


def given_values(
    step: Step, spec: Description, source: YamlSource, known_files: Sequence[Path], problems: InputProblems
) -> GivenValues:
    """Parameters, constant and computed channels, and the road.

    Parameters
    ----------
    known_files : parameter files, of which later ones have priority. problems : to which files and problems are added.
    """
    stated = given_parameters(spec.vehicle).updated(given_air(spec.environment))
    known = _with_files(stated, known_files, problems.files, problems.of_test)
    before = len(problems.of_test)
    constants = known_channels(step, spec, source, problems.of_test)
    made = attempt(problems.of_test, scalings, step, spec, known) or ()
    road = attempt(problems.of_test, surveyed_road, spec, source, problems.files)
    problems.of_channels += problems.of_test[before:]
    return GivenValues(stated, known, made, road, partial(ready_log, step, constants, made, road))


def read_logs(
    step: Step, spec: Description, source: YamlSource, problems: InputProblems
) -> dict[int, tuple[CutLog, tuple[ClockDifference, ...]]]:
    """Read the logs of all runs: those that can be read, by index, with the differences of their loggers' clocks.

    Parameters
    ----------
    problems : to which files are added, and runs that cannot be read.
    """
    apart = problems.of_runs
    tried = {i: attempt(apart.of(i), read_run, step, spec, source, i, problems.files) for i in range(len(spec.runs))}
    apart.name_columns_at_runs(len(spec.runs))
    return {i: one for i, one in tried.items() if one is not None}


def ready_runs(
    step: Step,
    read: Mapping[int, tuple[CutLog, tuple[ClockDifference, ...]]],
    ready: Callable[[Log], Log],
    problems: InputProblems,
) -> ReadRuns:
    """The runs from ``read_logs``, made ready for the step.

    Parameters
    ----------
    ready : adds constants, computed channels and the grade to a log. problems : to which runs are added that have
        impossible values.
    """
    apart = problems.of_runs
    clocks = tuple(clock for _, differences in read.values() for clock in differences)
    whole = {i: replace(one, log=ready(one.log)) for i, (one, _) in read.items()}
    if not problems.of_channels:
        tested = {i: attempt(apart.of(i), within_physical_limits, step, one.log) for i, one in whole.items()}
        whole = {i: one for i, one in whole.items() if tested[i] is not None}
    cut = with_pair_warnings(clocks, tuple(whole.values()))
    return ReadRuns(tuple(read), {i: one.log for i, one in zip(whole, cut, strict=True)}, cut, clocks)


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
