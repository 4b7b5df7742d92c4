"""What is wrong between the runs of a test, and between their logs and the description."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.yaml_source import YamlSource
from vdyn_cli.project.checks.description_checks import repeated_entries
from vdyn_cli.project.checks.exchanged_columns import exchanged_columns
from vdyn_cli.project.checks.repeated_runs import repeated_runs
from vdyn_cli.project.checks.run_unit_checks import contradicted_units, other_units
from vdyn_cli.project.checks.speed_unit_checks import contradicted_speed
from vdyn_cli.project.reading.channel_sources import channel_maps, logged_channels
from vdyn_cli.project.reading.read_inputs import GivenValues, InputProblems, ReadRuns
from vdyn_cli.project.reading.road_profile import road_findings
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps import Step


def compare_runs(
    step: Step, spec: Description, source: YamlSource, runs: ReadRuns, values: GivenValues, problems: InputProblems
) -> None:
    """Add what is wrong between runs, and between their logs and the description, to the problems.

    Channels are compared only if nothing is wrong that all logs depend on.
    """
    logs = tuple(runs.logs.values())
    if len(runs.read) == len(logs) and not repeated_entries(spec, source):
        problems.of_runs.compared.extend(repeated_runs(logs, [source.where(("runs", i)) for i in runs.read]))
    if not problems.of_channels:
        problems.of_runs.compared.extend(_wrong_units(step, spec, logs))
        problems.of_test += road_findings(values.road, spec, logs)
        problems.of_test += _contradicted_speed(spec, source, logs, values.known)


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
