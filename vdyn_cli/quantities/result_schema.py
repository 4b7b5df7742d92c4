"""Pydantic models of the published JSON files, such as a step's result and the pipeline's ``parameters.json``.

JSON has no number that is not finite: it is written as null, so the schema allows null for each number.
"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.cut_ledger import LedgerRow
from vdyn_cli.quantities.diagnosis import Diagnosis
from vdyn_cli.quantities.entry import Entry
from vdyn_cli.quantities.law_definition import LawDefinition


class EstimateEntry(Entry):
    """One parameter with its uncertainty, in SI units."""

    value: float = Field(description="estimate or given value, in 'unit'")
    std: float = Field(description="standard deviation of the estimate, in 'unit'; 0 for a value given as exact")
    interval95: tuple[float, float] = Field(description="lower and upper end of the 95 % interval, in 'unit'")
    unit: str = Field(description="SI unit; empty for a dimensionless parameter")
    meaning: str = Field(description="meaning of the parameter")
    baseline: float | None = Field(description="estimate without the extension of the model, in 'unit'; null if given")
    source: str = Field(description="'given', 'measured', or the step that estimated it")
    spans: list[str] = Field(
        [],
        description="effects whose values the interval includes, joined by ' + '; also 'baseline', or 'unexplained' "
        "for a bias that no effect explains; empty: the interval of the fit alone",
    )


class FitEntry(Entry):
    """How well the model follows the data."""

    runs: tuple[str, ...] = Field(description="logs that were used")
    rms: float = Field(description="root mean square of the residual, in 'unit'")
    noise_floor: float = Field(description="rms that measurement noise alone would leave, in 'unit'")
    unit: str = Field(description="unit of 'rms', 'noise_floor' and 'held_out_rms'")
    unknowns: tuple[str, ...] = Field(description="names of the parameters that were fitted together")
    interval_unit: str = Field(description="independent unit behind the intervals: 'run', 'block', or empty")
    interval_units: int = Field(description="number of independent units")
    held_out_rms: float | None = Field(description="rms in runs that the fit did not use, in 'unit'")
    warnings: tuple[str, ...] = Field(description="reasons to doubt the result")
    cause: str = Field("", description="what the step found wrong with the runs that makes the residual, or empty")


class FindingEntry(Entry):
    """One message: place, fact, offending value, remedy."""

    where: str = Field(description="file and line, or log and channel")
    what: str = Field(description="the fact")
    got: str = Field(description="the offending text or value; may be empty")
    remedy: str = Field(description="what to do; may be empty")
    minor: bool = Field(description="true: a note, no reason to doubt the result")
    fault: bool = Field(description="true: a sensor failed")
    doubt: bool = Field(description="true: a reason to doubt the result")


class Versions(BaseModel):
    """Versions of the program and of the packages that a result depends on."""

    model_config = ConfigDict(frozen=True, extra="allow")

    vdyn_cli: str = Field(description="version of this program")


class ProvenanceDocument(Entry):
    """Origin of the result; the same inputs, settings and versions give identical files."""

    inputs: dict[str, str] = Field(description="sha256 of every file that was read, by its path or name")
    settings: dict[str, JsonValue] = Field({}, description="the test's description with all defaults, in SI units")
    versions: Versions = Field(description="versions of the program and its packages")
    command: str = Field(description="the command that reproduces this file")


class ParameterSetDocument(BaseModel):
    """The common keys of the results of a step and of the pipeline, which ``--known`` and ``vdyn export`` read."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal["vdyn/parameters/1"] = Field(description="name and version of this format")
    step: str = Field(description="the step that wrote the file, or 'pipeline'")
    parameters: dict[str, EstimateEntry] = Field(description="estimates by name; see 'vdyn explain NAME'")
    correlation: dict[str, dict[str, float]] = Field(description="correlation of parameters that were fitted together")
    extensions: dict[str, dict[str, EstimateEntry]] = Field(
        description="effects that extend the model and belong to the vehicle: effect, its unknowns, their estimates"
    )
    laws: dict[str, LawDefinition] = Field(
        {}, description="definitions of the learned laws among the extensions, from which other steps rebuild them"
    )
    provenance: ProvenanceDocument = Field(description="inputs, settings, versions and command")


class SurveyEntry(Entry):
    """The survey of the road that gave the grade."""

    profile: str = Field(description="its file")
    start: float = Field(alias="from", description="first position, m")
    stop: float = Field(alias="to", description="last position, m")
    points: int = Field(description="number of points")
    kind: Literal["elevation", "grade"] = Field(description="surveyed quantity")
    std: float = Field(description="stated error of its values, m or m/m; 0: taken as exact")


class QualityEntry(BaseModel):
    """The quality of the logs. Further keys are checks of one step, such as ``agreement`` of a coast-down."""

    model_config = ConfigDict(frozen=True, extra="allow")

    channels: dict[str, dict[str, dict[str, int]]] = Field(
        description="log: channel: number of samples by state: good, not_evaluated, suspect, failed, missing"
    )
    ledger: list[LedgerRow] = Field(description="segments that were cut, or kept although they failed a test")
    clocks: list[ClockDifference] = Field([], description="differences of the clocks of several loggers")
    road: SurveyEntry | None = Field(None, description="survey of the road (coast-down); null without one")
    influence: dict[str, dict[str, float]] = Field(
        {}, description="run: parameter: its change when this run is left out, in its SI unit"
    )


class ResultDocument(ParameterSetDocument):
    """The result of one step. Further keys hold numbers of that step alone, such as ``road_load`` of a coast-down."""

    model_config = ConfigDict(frozen=True, extra="allow")

    sentence: str = Field(description="the result in one sentence")
    refused: list[FindingEntry] = Field(
        description="why the result is not published; there are no parameters then. Empty for a published result"
    )
    withheld: dict[str, str] = Field(description="parameters that the data do not determine, each with the reason")
    fit: FitEntry = Field(description="how well the model follows the data")
    findings: list[FindingEntry] = Field(description="notes and doubts about inputs and result")
    quality: QualityEntry = Field(
        QualityEntry(channels={}, ledger=[]), description="quality of the logs' samples, and what was cut"
    )
    diagnosis: Diagnosis | None = Field(description="errors of the model; null without a diagnosis")


class StepSummary(Entry):
    """How one step of a pipeline ended."""

    good: bool = Field(description="whether the step has a result")
    sentence: str = Field(description="the result in one sentence, or why there is none")
    verdict: str = Field(description="verdict of the diagnosis; empty without a diagnosis")
    diagnosis: str = Field(description="the diagnosis in one sentence; empty without a diagnosis")


class ParametersDocument(ParameterSetDocument):
    """The pipeline's ``parameters.json``: the full parameter set of a test day."""

    title: str = Field(description="title of the pipeline")
    missing: dict[str, str] = Field(description="parameters without a value, and why")
    steps: dict[str, StepSummary] = Field(description="how each step ended")


class ChannelEntry(Entry):
    """One channel of a log."""

    column: str = Field(description="name as a description's 'column' states it")
    group: str = Field(description="group of the channel in the file; empty where it has none")
    source: str = Field(description="device or bus that the file names; empty where it names none")
    unit: str = Field(
        description="unit that the file states, or that the end of the name or a clock's rate shows; empty if unknown"
    )
    rate: float | None = Field(description="written samples per second, Hz; null without a clock")
    span: tuple[float, float] | None = Field(description="first and last time with a sample, s; null without a clock")
    state: Literal["clock", "varies", "constant", "empty", "text"] = Field(description="what the samples do")
    samples: int = Field(description="number of written samples")
    lowest: float | None = Field(description="smallest sample, in 'unit'")
    highest: float | None = Field(description="largest sample, in 'unit'")
    rest: tuple[float, float, float] | None = Field(
        description="longest rest of a channel that otherwise varies: from (s), to (s), value in 'unit'; null if short"
    )
    same_as: str = Field(description="first channel of the file with the same samples; empty where there is none")
    repeated: int = Field(description="how many channels of the file have this name")
    gaps: tuple[int, float, float] | None = Field(
        description="of a clock: number of gaps, last time before and first time after the longest one, s; else null"
    )
    stalls: list[tuple[float, float]] = Field(
        description="of a clock: from (s), to (s) of the segments in which all its channels repeat their values"
    )
    recordings: list[tuple[float, float]] = Field(
        description="of a clock that restarts: from (s), to (s) of each recording; the other keys are of the first"
    )


class ChannelsDocument(Entry):
    """What ``vdyn channels --json`` writes: every channel of one log."""

    format: Literal["vdyn/channels/1"] = Field(description="name and version of this format")
    log: str = Field(description="name of the file")
    channels: list[ChannelEntry] = Field(description="the channels in the order of the file")


class ComparedEntry(Entry):
    """One parameter of two files."""

    name: str = Field(description="parameter, or 'effect.unknown' of an effect that extends the model")
    unit: str = Field(description="unit of every number of this entry; empty for a dimensionless parameter")
    meaning: str = Field(description="meaning of the parameter")
    old: float = Field(description="value in the first file")
    old_interval95: tuple[float, float] = Field(description="its 95 % interval")
    new: float = Field(description="value in the second file")
    new_interval95: tuple[float, float] = Field(description="its 95 % interval")
    difference: float = Field(description="new minus old")
    standard_error: float = Field(description="standard error of the difference if both errors are independent")
    z: float | None = Field(description="difference over standard error; null if values without an error differ")
    moved: bool = Field(description="whether the difference is beyond both uncertainties, at 95 %")


class ComparisonDocument(Entry):
    """What ``vdyn compare --json`` writes."""

    format: Literal["vdyn/comparison/1"] = Field(description="name and version of this format")
    old: str = Field(description="first file")
    new: str = Field(description="second file")
    sentence: str = Field(description="the answer")
    moved: bool = Field(description="true: a parameter changed significantly, exit code 1")
    parameters: list[ComparedEntry] = Field(description="parameters that are in both files")
    only_old: list[str] = Field(description="parameters that only the first file has")
    only_new: list[str] = Field(description="parameters that only the second file has")
    verdicts: list[str] = Field(description="verdicts of the diagnosis that differ, one per step")
    assumed: str = Field(description="what is assumed about the errors of both files")


class _NumbersOrNull(GenerateJsonSchema):
    def float_schema(self, schema: core_schema.FloatSchema) -> JsonSchemaValue:
        return {**super().float_schema(schema), "type": ["number", "null"]}


def document_schema(model: type[BaseModel]) -> dict[str, Any]:
    """The JSON schema of a published document, in which each number may be null.

    Parameters
    ----------
    model : one of the documents above, such as :class:`ResultDocument`.
    """
    return model.model_json_schema(schema_generator=_NumbersOrNull)
