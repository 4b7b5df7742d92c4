"""A test day's steps: their order, from what each needs and gives, and the parameter set they fill."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from vdyn_cli.description.test_description import Strict, Vehicle, load_spec
from vdyn_cli.description.yaml_source import Source, load_yaml
from vdyn_cli.diagnosis.policy import POLICY, shared_level
from vdyn_cli.io.files import sha256
from vdyn_cli.project.inputs import given_parameters
from vdyn_cli.project.result_document import versions
from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.parameters import FORMAT, GIVERS, Parameters, read_parameters, to_document
from vdyn_cli.quantities.vocabulary import TABLE
from vdyn_cli.steps import Step, load_step, names


class PipelineSpec(Strict):
    """A pipeline's description: its title, the vehicle as known beforehand, and the tests' descriptions."""

    pipeline: str
    vehicle: Vehicle = Vehicle()
    steps: list[str]


Status = Literal["done", "reused", "failed", "skipped"]


@dataclass(frozen=True)
class StepOutcome:
    """How one step of the pipeline ended.

    Parameters
    ----------
    findings : why it failed or was skipped, or what to read first.
    diagnosis : what its diagnosis came to; empty where none was made. verdict : the same in one word.
    """

    name: str
    status: Status
    sentence: str = ""
    findings: tuple[Finding, ...] = ()
    exit_code: int = 0
    verdict: str = ""
    diagnosis: str = ""

    @property
    def good(self) -> bool:
        return self.status in ("done", "reused")


@dataclass(frozen=True)
class Task:
    """One step of a pipeline: its description, the steps whose results it reads, its chance of a false alarm."""

    name: str
    path: Path
    after: tuple[str, ...]
    level: float = POLICY.level


def load_plan(path: Path) -> tuple[PipelineSpec, Source, tuple[Task, ...]]:
    """Read a pipeline's description and put its steps in order.

    A step comes after every other one that gives a parameter it may need; else the order of the file stands.

    Raises
    ------
    InputError : a description that can't be read, names no step, repeats one, or steps that wait for each other.
    """
    spec, source = load_spec(path, PipelineSpec)
    found: dict[str, Path] = {}
    findings: list[Finding] = []
    for i, name in enumerate(spec.steps):
        place = source.where(("steps", i))
        try:
            test = _test_of(path.parent / name, place)
        except InputError as error:
            findings.extend(error.findings)
            continue
        if test in found:
            findings.append(Finding(place, f"a second description of '{test}'", name, "put all its runs into one"))
        found[test] = path.parent / name
    raise_all(findings)
    steps = {test: load_step(test) for test in found}
    order = in_order(steps)
    level = shared_level(sum(s.diagnosable is not None for s in steps.values()))
    return spec, source, tuple(Task(n, found[n], _givers(steps[n], steps, order), level) for n in order)


def _test_of(path: Path, place: str) -> str:
    data = load_yaml(path).data
    test = data.get("test") if isinstance(data, dict) else None
    if test not in names():
        remedy = f"write 'test:' with one of {', '.join(names())}"
        raise InputError(Finding(f"{place}, {path.name}", "describes no known test", repr(test), remedy))
    return str(test)


def _givers(step: Step, steps: Mapping[str, Step], order: Sequence[str]) -> tuple[str, ...]:
    return tuple(n for n in order if n != step.name and set(steps[n].gives) & set(step.needs))


def in_order(steps: Mapping[str, Step]) -> tuple[str, ...]:
    """Names of steps, each after those whose results it reads; ties in the given order.

    Raises
    ------
    InputError : steps that wait for each other.
    """
    done: list[str] = []
    while len(done) < len(steps):
        waiting = [n for n in steps if n not in done]
        ready = [n for n in waiting if not _givers(steps[n], steps, waiting)]
        if not ready:
            raise InputError(Finding("pipeline", "steps wait for each other's results", ", ".join(waiting)))
        done.append(ready[0])
    return tuple(done)


def summary_document(
    spec: PipelineSpec, path: Path, files: Sequence[Path], folder: Path, outcomes: Sequence[StepOutcome]
) -> dict[str, Any]:
    """The full parameter set: what was given, what each step estimated, and what is missing and why."""
    known = given_parameters(spec.vehicle)
    results = [folder / f"{o.name}.json" for o in outcomes if o.good]
    for result in results:
        known = known.updated(read_parameters(result))
    ordered = Parameters({n: known[n] for n in (*TABLE, *known) if n in known}, known.correlation, known.extensions)
    failed = {o.name: o.sentence for o in outcomes if not o.good}
    inputs = {f.name: sha256(f) for f in files} | {f.name: sha256(f) for f in results}
    return {
        "format": FORMAT,
        "step": "pipeline",
        "title": spec.pipeline,
        **to_document(ordered),
        "missing": {name: _why_missing(name, failed) for name in TABLE if name not in known},
        "steps": {
            o.name: {"good": o.good, "sentence": o.sentence, "verdict": o.verdict, "diagnosis": o.diagnosis}
            for o in outcomes
        },
        "provenance": {"inputs": inputs, "versions": versions(), "command": f"vdyn pipeline {path.name}"},
    }


def _why_missing(name: str, failed: Mapping[str, str]) -> str:
    giver = GIVERS.get(name)
    if giver is None:
        return "not given under vehicle"
    return f"{giver} failed: {failed[giver]}" if giver in failed else f"no '{giver}' test in this pipeline"
