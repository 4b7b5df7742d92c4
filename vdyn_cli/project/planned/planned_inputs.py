"""The inputs of a planned test without logs: its description, and a simulated day instead of the logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.spec_loading import load_partial
from vdyn_cli.description.yaml_source import YamlSource
from vdyn_cli.project.checks.description_checks import wrong_channels, wrong_effects
from vdyn_cli.project.inputs import Inputs, condensed_logs, errors_of_step
from vdyn_cli.project.reading.channel_sources import (
    Scaling,
    channel_maps,
    known_channels,
    scalings,
    with_known_channels,
)
from vdyn_cli.project.reading.given_values import given_air, given_parameters, read_known
from vdyn_cli.quantities.errors import Finding, InputError, attempt, did_you_mean, in_file_order, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import UnitError, parse
from vdyn_cli.steps import Step
from vdyn_cli.steps.planned_day import DayRequest, PlannedDay
from vdyn_cli.steps.step_definition import alternative_channels


@dataclass(frozen=True)
class DayDescription:
    """A description without logs.

    Parameters
    ----------
    spec : with one entry under ``runs`` for each planned run. known : parameters of the description and of files.
    at : value of each setting of the day, SI. stated : names of settings that the description states.
    """

    step: Step
    spec: Any
    source: YamlSource
    known: Parameters
    at: Mapping[str, float]
    stated: frozenset[str]

    def day(self, seed: int) -> Inputs:
        """The inputs of one simulated day; each seed gives another day.

        Raises
        ------
        InputError : the description lacks a value that the simulation needs.
        """
        step, spec = self.step, self.spec
        assert step.planned is not None
        rng = np.random.default_rng(seed)
        with errors_of_step(step, self.source, ()):
            logs = step.planned.logs(DayRequest(spec, self.known, self.at, rng))
        problems: list[Finding] = []
        constants = known_channels(step, spec, self.source, problems)
        made = attempt(problems, scalings, step, spec, self.known) or ()
        raise_all(problems)
        mapped = {n for channels, _ in channel_maps(spec) for n in channels}
        mapped |= {one.channel.target for one in made}
        absent = sorted(mapped - {"time", *constants, *logs[0].channels, *_sources(step)} - _parts(step))
        what = "is mapped, but the simulation has no such channel; the plan does not use it"
        findings = tuple(Finding(f"channel '{name}'", what) for name in absent)
        logs = tuple(with_known_channels(_sourced(_mapped(step, log, mapped), made), constants, ()) for log in logs)
        used, _ = condensed_logs(logs, step.rate(spec))
        data: Any = used if step.load is None else step.load(spec, self.source.path.parent, used)[0]
        return Inputs(step, spec, self.source, data, logs, self.known, {}, findings, made)


def _sources(step: Step) -> frozenset[str]:
    """Channels from which others are computed."""
    return frozenset(one.source for one in step.scaled)


def _parts(step: Step) -> set[str]:
    """Channels whose sums are other channels, such as the loads of an axle's wheels."""
    return {n for entry in (*step.required, *step.optional) for way in alternative_channels(entry)[1:] for n in way}


def _sourced(log: Log, made: Sequence[Scaling]) -> Log:
    """The log with the source channels of computed ones, so that the uncertainty of their constants is included."""
    return log.with_channels(**{one.channel.source: log[one.channel.target] / one.factor for one in made})


def _mapped(step: Step, log: Log, mapped: set[str]) -> Log:
    """The log with the channels that the description maps, or whose parts it maps; with all if it maps none."""
    if not mapped:
        return log
    wanted = set(mapped)
    for entry in (*step.required, *step.optional):
        (total, *_), *ways = alternative_channels(entry)
        if any(set(way) <= mapped for way in ways):
            wanted.add(total)
    return replace(log, channels={n: v for n, v in log.channels.items() if n in wanted})


def planned_test(step: Step, path: Path, known_files: Sequence[Path], runs: int | None) -> DayDescription:
    """Read a description whose logs do not exist.

    Parameters
    ----------
    path : the description. known_files : parameter files.
    runs : number of runs; None: as many as the description lists, or the step's usual number.

    Raises
    ------
    InputError : with all problems of the description and the parameter files; the step cannot be planned without a log.
    """
    described = load_partial(path, step.spec)
    spec, source = described.spec, described.source
    if spec is None:
        raise InputError(*described.problems)
    step = step.of(spec)
    if step.planned is None:
        what = f"'{step.name}' cannot be planned without a log: the excitation of the car in this test is unknown"
        remedy = "drive one run, list its log under runs, and plan from it with --runs"
        raise InputError(Finding(source.where(("test",)), what, "", remedy))
    problems: list[Finding] = [*described.problems, *wrong_effects(step, spec, source)]
    known = given_parameters(spec.vehicle).updated(given_air(spec.environment))
    for file in known_files:
        if (later := attempt(problems, read_known, file)) is not None:
            known = known.updated(later[0])
    spec = spec.model_copy(update={"runs": _runs(step.spec, spec, step.planned, runs)})
    if any(channels for channels, _ in channel_maps(spec)):
        problems += wrong_channels(step, spec, source, described.dropped)
    at = _settings(step.planned, spec, source, known, problems)
    raise_all(in_file_order(tuple(dict.fromkeys(problems)), source.path.name))
    return DayDescription(step, spec, source, known, at, frozenset(spec.plan))


def _runs(model: type[Description], spec: Description, day: PlannedDay, runs: int | None) -> list[Any]:
    """The entries of the planned runs: those of the description, repeated if more are planned."""
    entry = type(spec.runs[0]) if spec.runs else model.model_fields["runs"].annotation.__args__[0]  # type: ignore[union-attr]
    count = runs or len(spec.runs) or day.runs
    found = []
    for k in range(count):
        if not spec.runs:
            found.append(entry(log=f"run {k + 1}", **day.run(k)))
            continue
        one, again = spec.runs[k % len(spec.runs)], k // len(spec.runs)
        found.append(one.model_copy(update={"log": f"{one.log or one.logs}{f' ({again + 1})' if again else ''}"}))
    return found


def _settings(
    day: PlannedDay, spec: Description, source: YamlSource, known: Parameters, problems: list[Finding]
) -> dict[str, float]:
    """The value of each setting, SI: as the description states it, else its default.

    Parameters
    ----------
    problems : list to which problems of the settings are added.
    """
    wanted = [one.quantity.name for one in day.settings]
    for name in (n for n in spec.plan if n not in wanted):
        remedy = did_you_mean(name, wanted, f"known keys: {', '.join(wanted)}")
        problems.append(Finding(source.where(("plan", name)), f"unknown key '{name}' under plan", remedy=remedy))
    found: dict[str, float] = {}
    for one in day.settings:
        quantity, name = one.quantity, one.quantity.name
        if name not in spec.plan:
            value = attempt(problems, one.default, spec, known)
            found |= {name: value} if value is not None else {}
            continue
        where, example = source.where(("plan", name)), f"write a number in {quantity.unit or '1'}, or with its unit"
        try:
            found[name] = parse(spec.plan[name], quantity.unit).value
        except UnitError as error:
            problems.append(Finding(where, f"'plan.{name}' {error}", "", example))
            continue
        if not quantity.allows(found[name]):
            what = f"'plan.{name}' lies outside {quantity.range_text}"
            problems.append(Finding(where, what, str(spec.plan[name]), example))
    return found
