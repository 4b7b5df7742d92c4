"""Checks of a description that need its step, before any log is read."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from vdyn_cli.description.description_model import Description, Reading
from vdyn_cli.description.spec_errors import check_channels
from vdyn_cli.description.yaml_source import Location, YamlSource, load_yaml
from vdyn_cli.effects import candidates
from vdyn_cli.io.file_units import unit_problem
from vdyn_cli.io.files import remedy_for_missing_file
from vdyn_cli.project.reading.channel_sources import channel_maps, logged_channels, needed_channel, readable_channels
from vdyn_cli.project.reading.logger_columns import column_of, log_names
from vdyn_cli.quantities.errors import Finding, InputError, did_you_mean
from vdyn_cli.quantities.quality_flags import EVERY
from vdyn_cli.steps import Step, names
from vdyn_cli.steps.step_definition import alternative_channels


def missing_logs(source: YamlSource) -> list[Finding]:
    """Findings on logs that do not exist, from the raw data of a description that cannot be loaded."""
    runs = source.data.get("runs") if isinstance(source.data, dict) else None
    found = []
    for i, run in enumerate(runs if isinstance(runs, list) else ()):
        named = [run.get("log"), *(run.get("logs") or [])] if isinstance(run, dict) else []
        for name in named:
            if isinstance(name, str) and not (source.path.parent / name).exists():
                remedy = remedy_for_missing_file(source.path.parent / name)
                found.append(Finding(source.where(("runs", i)), f"the log {name} does not exist", "", remedy))
    return found


def refuse_other_test(step: Step, path: Path) -> None:
    """Refuse the description of another step at once, since by this step's keys every line of it would be wrong.

    Raises
    ------
    InputError : the key ``test`` of the description at ``path`` is that of another step, or it describes a pipeline.
    """
    source = load_yaml(path)
    refuse_pipeline(source)
    test = source.data.get("test") if isinstance(source.data, dict) else None
    if isinstance(test, str) and test != step.name:
        what = f"test type mismatch: this command needs 'test: {step.name}'"
        other = f"run 'vdyn {test} {path}', or correct the key 'test'"
        remedy = other if test in names() else f"write 'test: {step.name}'"
        raise InputError(Finding(source.where(("test",)), what, repr(test), remedy))


def refuse_pipeline(source: YamlSource) -> None:
    """Refuse the description of a pipeline where that of a test is needed.

    Raises
    ------
    InputError : the description has the key ``pipeline`` and no key ``test``.
    """
    if isinstance(source.data, dict) and "pipeline" in source.data and "test" not in source.data:
        remedy = f"run 'vdyn pipeline {source.path}', or give one of the tests that it lists under 'steps'"
        raise InputError(Finding(source.where(("pipeline",)), "the file describes a pipeline, not a test", "", remedy))


def wrong_channels(step: Step, spec: Description, source: YamlSource, dropped: Collection[Location]) -> list[Finding]:
    """Findings on unknown channels, wrong units, and required channels that no logger maps.

    Parameters
    ----------
    dropped : locations of the description that were removed because they are wrong.
    """
    known = readable_channels(step, spec)
    findings = check_channels(spec.channels, known, source, ("channels",))
    for i, logger in enumerate(spec.loggers):
        findings += check_channels(logger.channels, known, source, ("loggers", i, "channels"))
    for channels, at in channel_maps(spec):
        columns = {
            n: column_of(known[n], c, source, (*at, n)) for n, c in logged_channels(channels).items() if n in known
        }
        findings += [f for c in columns.values() if (f := unit_problem(c, source.path.name)) is not None]
    if not spec.runs:
        return findings
    for channels, at in channel_maps(spec):
        if "time" in channels and "time" not in logged_channels(channels):
            place = source.where((*at, "time"))
            findings.append(Finding(place, "the channel 'time' cannot be a constant", "", "write its column and unit"))
    findings += _rates_beside_time(spec, source)
    return [*findings, *_missing_channels(step, spec, source, dropped)]


def _missing_channels(
    step: Step, spec: Description, source: YamlSource, dropped: Collection[Location]
) -> list[Finding]:
    """Findings on required channels that no logger maps; the first names another manoeuvre that the channels suit."""
    known = readable_channels(step, spec)
    mapped = {n for channels, _ in channel_maps(spec) for n in channels}
    mapped |= {str(at[-1]) for at in dropped if at[:-1] and at[-2] == "channels"}
    mapped |= set(known) if ("channels",) in dropped or ("loggers",) in dropped else set()
    mapped |= {one.target for one in step.scaled if one.source in mapped}
    place = source.where(("loggers",) if spec.loggers else ("channels",))
    missing = []
    for entry in (e for e in step.required if not _mapped(e, mapped)):
        ways = alternative_channels(entry)
        least = min(ways, key=lambda way: (len(set(way) - mapped), -len(way)))
        first = next(n for n in least if n not in mapped)
        line = f"{first}: {{column: '<header>', unit: {known[first].unit or '1'}}}"
        remedy = f"add '{line}' to the channels{needed_channel(step, least)}"
        if entry == "time":
            remedy += "; if the logs have no time but a fixed rate, write it, such as 'reading: {rate: 1 Hz}'"
        names = " or ".join(" + ".join(way) for way in ways)
        missing.append(Finding(place, f"channel {names} is needed", remedy=remedy))
    others = [n for n, one in step.manoeuvres.items() if all(_mapped(entry, mapped) for entry in one.required)]
    if missing and others:
        more = f"; or write 'manoeuvre: {others[0]}' if the logs are of that test ('vdyn explain {step.name}')"
        missing[0] = replace(missing[0], remedy=missing[0].remedy + more)
    return missing


def _rates_beside_time(spec: Description, source: YamlSource) -> Iterator[Finding]:
    """Findings on logs of which both a fixed rate and a column of time are stated."""
    stated: list[tuple[Reading, Mapping[str, object], Location]] = [(spec.reading, spec.channels, ())]
    stated += [(one.reading, one.channels, ("loggers", i)) for i, one in enumerate(spec.loggers)]
    for reading, channels, at in stated:
        if reading.rate is not None and "time" in channels:
            what = "'reading: rate' is for logs without a column of time, but channel 'time' is mapped"
            yield Finding(source.where((*at, "reading", "rate")), what, remedy="remove one of them")


def _mapped(entry: str, mapped: Collection[str]) -> bool:
    """Whether a needed channel, or one of its alternatives, is mapped."""
    return any(set(way) <= set(mapped) for way in alternative_channels(entry))


def wrong_effects(step: Step, spec: Description, source: YamlSource) -> Iterator[Finding]:
    """Findings on ``diagnose.effects`` and ``diagnose.extend``: effects that are not candidates of this step, are
    listed twice, or are to extend the model but are not tested."""
    requested = spec.diagnose
    for key in ("effects", "extend"):
        named = getattr(requested, key)
        names = named if isinstance(named, list) else []
        known = [e.name for e in candidates(step.situations)] if names else []
        for i, name in enumerate(names):
            what, remedy = "", ""
            if name not in known:
                what, remedy = f"not a candidate effect for '{step.name}'", did_you_mean(name, known, _listed(known))
            elif name in names[:i]:
                what, remedy = "is listed twice", "remove one"
            elif key == "extend" and isinstance(requested.effects, list) and name not in requested.effects:
                what, remedy = "is not in diagnose.effects, so it is not tested", "add it there"
            if what:
                yield Finding(source.where(("diagnose", key, i)), f"'diagnose.{key}': {what}", name, remedy)


def _listed(names: Iterable[str]) -> str:
    return f"candidate effects: {', '.join(names)}"


def repeated_entries(spec: Description, source: YamlSource) -> list[Finding]:
    """Findings on runs whose time windows in the same log overlap: they would count as independent data."""
    seen: dict[tuple[str, ...], list[tuple[float, float, int]]] = {}
    findings = []
    for i, run in enumerate(spec.runs):
        start = run.from_time.value if run.from_time else -np.inf
        stop = run.to_time.value if run.to_time else np.inf
        columns = (f"{channel}: {column}" for each in run.own("columns") for channel, column in sorted(each.items()))
        own = (f"recordings: {[number or 1 for number in run.recordings]}", *columns)
        others = seen.setdefault((*map(os.path.normpath, log_names(run)), *own), [])
        for first, last, k in others:
            if min(stop, last) > max(start, first):
                same = (start, stop) == (first, last)
                what = "the same log is listed twice" if same else "the time window overlaps that of another run"
                got = f"{log_names(run)[0]}, first at {source.where(('runs', k))}"
                remedy = "list each recording once: a copy is not independent data"
                findings.append(Finding(source.where(("runs", i)), what, got, remedy))
                break
        others.append((start, stop, i))
    return findings


def wrong_segments(spec: Description, source: YamlSource) -> Iterator[Finding]:
    """Findings on segments to cut or keep whose channel is not mapped, or that end before they begin."""
    mapped = sorted({n for channels, _ in channel_maps(spec) for n in logged_channels(channels)} - {"time"})
    for i, run in enumerate(spec.runs):
        for key, listed in (("cuts", run.cuts), ("keep", run.keep)):
            for k, one in enumerate(listed if isinstance(listed, list) else ()):
                place = source.where(("runs", i, key, k))
                if one.channel not in (EVERY, *mapped):
                    remedy = did_you_mean(one.channel, mapped, f"write {EVERY}, or one of {', '.join(mapped)}")
                    yield Finding(place, f"'{key}': channel '{one.channel}' is not mapped", remedy=remedy)
                if one.stop.value < one.start.value:
                    got = f"from {one.start.value:g} s to {one.stop.value:g} s"
                    yield Finding(place, f"'{key}': the segment ends before it begins", got, "exchange 'from' and 'to'")
