"""The steps of a test day, ordered by the parameters that each needs and estimates, and the full parameter set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from vdyn_cli.description.description_model import Vehicle
from vdyn_cli.description.quantity_field import Strict
from vdyn_cli.description.spec_loading import load_spec
from vdyn_cli.description.yaml_source import YamlSource, load_yaml
from vdyn_cli.diagnosis.policy import POLICY, shared_level
from vdyn_cli.project.reading.given_values import given_parameters
from vdyn_cli.project.result_document import Provenance, StepRecord, versions
from vdyn_cli.quantities.diagnosis import Diagnosis
from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.parameters import ESTIMATED_BY, FORMAT, Parameters, to_document
from vdyn_cli.quantities.vocabulary import TABLE
from vdyn_cli.steps import Step, load_step, names


class PipelineSpec(Strict):
    """A pipeline's description: title, known vehicle parameters, and paths of the tests' descriptions."""

    pipeline: str = Field(description="title of the report")
    vehicle: Vehicle = Field(Vehicle(), description="known parameters of the vehicle, or a YAML file of them")
    steps: list[str] = Field(description="paths of the tests' descriptions, from the folder of this file, in any order")


Status = Literal["done", "reused", "failed", "skipped"]


@dataclass(frozen=True)
class StepOutcome:
    """The outcome of one step of the pipeline.

    Parameters
    ----------
    record : its result, read from the JSON in the folder; None if it failed or was skipped.
    section : its HTML on the page of the pipeline, with figures, tables and methods; empty without a record.
    reason : why it failed or was skipped, in one sentence.
    problems : why it failed or was skipped, one finding for each problem.
    refused : the record of a result that is not published; without parameters.
    digest : sha256 of the JSON of the record.
    """

    name: str
    status: Status
    record: StepRecord | None = None
    section: str = ""
    reason: str = ""
    problems: tuple[Finding, ...] = ()
    exit_code: int = 0
    refused: StepRecord | None = None
    digest: str = ""

    @property
    def good(self) -> bool:
        """Whether there is a result."""
        return self.record is not None

    @property
    def sentence(self) -> str:
        """The result in a sentence, or the reason why there is none."""
        return self.reason if self.record is None else self.record.result.sentence

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The reasons why it failed or was skipped, or the notes to read before the result is used."""
        return self.problems if self.record is None else self.record.to_read

    @property
    def diagnosis(self) -> Diagnosis | None:
        """The diagnosis of its result, published or not; None without a diagnosis."""
        shown = self.record or self.refused
        return None if shown is None else shown.result.diagnosis


@dataclass(frozen=True)
class ParameterSet:
    """The full parameter set of a pipeline.

    Parameters
    ----------
    title : of the pipeline's description.
    parameters : given and estimated parameters, in the order of the vocabulary.
    missing : the reason why a parameter of the vocabulary is not known, by name.
    outcomes : of the steps, in the order in which they ran.
    """

    title: str
    parameters: Parameters
    missing: Mapping[str, str]
    outcomes: tuple[StepOutcome, ...]
    provenance: Provenance

    @property
    def document(self) -> dict[str, Any]:
        """The content of ``parameters.json``."""
        return {
            "format": FORMAT,
            "step": "pipeline",
            "title": self.title,
            **to_document(self.parameters),
            "missing": dict(self.missing),
            "steps": {o.name: _summary(o) for o in self.outcomes},
            "provenance": self.provenance.to_json(),
        }


def _summary(outcome: StepOutcome) -> dict[str, Any]:
    found = outcome.diagnosis
    verdict, sentence = (found.verdict, found.sentence) if found else ("", "")
    return {"good": outcome.good, "sentence": outcome.sentence, "verdict": verdict, "diagnosis": sentence}


@dataclass(frozen=True)
class Task:
    """One step of a pipeline.

    Parameters
    ----------
    path : its description.
    after : the steps whose results it reads.
    level : false-alarm probability of its diagnosis.
    """

    name: str
    path: Path
    after: tuple[str, ...]
    level: float = POLICY.level


def _refuse_test(source: YamlSource) -> None:
    """Refuse the description of a test where that of a pipeline is needed."""
    test = source.data.get("test") if isinstance(source.data, dict) and "pipeline" not in source.data else None
    if test in names():
        what, name = "the file describes a test, not a pipeline", source.path.name
        remedy = f"run 'vdyn {test} {source.path}', or list {name} under 'steps' of a pipeline"
        raise InputError(Finding(source.where(("test",)), what, f"test: {test}", remedy))


def load_plan(path: Path) -> tuple[PipelineSpec, YamlSource, tuple[Task, ...]]:
    """Read a pipeline's description and put its steps in order.

    A step comes after all steps that estimate a parameter it may need; otherwise the order of the file is kept. The
    false-alarm probability of each diagnosis is set such that it is 5 % for all together (Bonferroni).

    Raises
    ------
    InputError : lists all problems: an unreadable description, one without a known step, two descriptions of the same
        step, or a circular dependency of steps.
    """
    _refuse_test(load_yaml(path))
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
            findings.append(
                Finding(place, f"duplicate description of '{test}'", name, "put all its runs into one description")
            )
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
        raise InputError(Finding(f"{place}, {path.name}", "'test' is not a known step", repr(test), remedy))
    return str(test)


def _givers(step: Step, steps: Mapping[str, Step], order: Sequence[str]) -> tuple[str, ...]:
    return tuple(n for n in order if n != step.name and set(steps[n].gives) & set(step.needs))


def in_order(steps: Mapping[str, Step]) -> tuple[str, ...]:
    """Names of steps, each after those whose results it reads, otherwise in the given order.

    Raises
    ------
    InputError : circular dependency of steps.
    """
    done: list[str] = []
    while len(done) < len(steps):
        waiting = [n for n in steps if n not in done]
        ready = [n for n in waiting if not _givers(steps[n], steps, waiting)]
        if not ready:
            remedy = "leave one of them out, and pass its result with --known"
            raise InputError(Finding("pipeline", "circular dependency of steps", ", ".join(waiting), remedy))
        done.append(ready[0])
    return tuple(done)


def parameter_set(spec: PipelineSpec, source: YamlSource, outcomes: Sequence[StepOutcome]) -> ParameterSet:
    """The full parameter set: given, estimated, and missing parameters with the reason.

    Parameters
    ----------
    spec, source : the pipeline's description, and its data with the included files. outcomes : of the steps.
    """
    known = given_parameters(spec.vehicle)
    for outcome in outcomes:
        if outcome.record is not None:
            known = known.updated(outcome.record.result.parameters)
    estimates = {n: known[n] for n in (*TABLE, *known) if n in known}
    ordered = Parameters(estimates, known.correlation, known.extensions, known.laws)
    failed = {o.name: o.sentence for o in outcomes if not o.good}
    inputs = {file.name: digest for file, digest in source.digests.items()}
    inputs |= {f"{o.name}.json": o.digest for o in outcomes if o.good}
    provenance = Provenance(inputs, None, versions(), f"vdyn pipeline {source.path.name}")
    missing = {name: _why_missing(name, failed, outcomes) for name in TABLE if name not in known}
    return ParameterSet(spec.pipeline, ordered, missing, tuple(outcomes), provenance)


def _why_missing(name: str, failed: Mapping[str, str], outcomes: Sequence[StepOutcome]) -> str:
    giver = ESTIMATED_BY.get(name)
    if giver is None:
        return "not given under vehicle"
    if giver in failed:
        return f"{giver} failed: {failed[giver]}"
    done = any(o.name == giver for o in outcomes)
    return f"the data of '{giver}' do not determine it" if done else f"no '{giver}' test in this pipeline"
