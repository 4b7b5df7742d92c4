"""The document of ``vdyn plan``: expected accuracy of runs, for the terminal and the JSON."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from vdyn_cli.quantities.diagnosis import Detectable, NotTestable
from vdyn_cli.quantities.entry import Entry
from vdyn_cli.quantities.result_schema import FindingEntry


class PlannedParameter(Entry):
    """A parameter that the step estimates, with its expected accuracy."""

    name: str = Field(description="name of the parameter")
    value: float | None = Field(description="value that the plan assumes or the logs give, SI")
    std: float | None = Field(description="expected standard error, SI; null where it is not determined")
    half95: float | None = Field(description="expected half-width of the 95 % interval, SI")
    unit: str = Field(description="SI unit")
    determined: bool = Field(description="whether the runs determine it")
    why: str = Field(description="why not; empty where they do")


class Assumed(Entry):
    """A value that the simulation of the test day assumes."""

    name: str = Field(description="key under 'plan' of the description")
    value: float = Field(description="value, SI")
    unit: str = Field(description="SI unit")
    meaning: str = Field(description="what it is")
    stated: bool = Field(description="whether the description states it")


class Separation(Entry):
    """How well runs separate two effects, or detect one."""

    effects: list[str] = Field(description="one effect, or two")
    t: float = Field(description="standard errors, at half of the plausible range")


class AddedRuns(Entry):
    """Runs that could be added, and their expected benefit."""

    manoeuvre: str = Field(description="what to drive")
    runs: int = Field(description="number of further runs")
    separates: list[Separation] = Field(description="open questions that these runs answer")
    std: dict[str, float] = Field(description="expected standard error of each parameter with these runs, SI")


class PlanDocument(Entry):
    """The whole plan."""

    format: Literal["vdyn/plan/1"] = Field(description="format and version")
    step: str = Field(description="the step")
    title: str = Field(description="title of the description")
    basis: Literal["simulated", "logs"] = Field(description="whether the plan is from simulated runs or from logs")
    runs: int = Field(description="number of runs that the figures are for")
    channels: list[str] = Field(description="channels that the plan assumes to be logged")
    good: bool = Field(description="whether the runs determine every parameter")
    sentence: str = Field(description="the answer")
    parameters: list[PlannedParameter] = Field(description="expected accuracy")
    detectable: list[Detectable] = Field(
        description="candidate effects that the runs can detect, and their smallest size"
    )
    not_testable: list[NotTestable] = Field(description="candidate effects that the runs cannot detect, and why")
    confused: list[Separation] = Field(description="pairs of effects that the runs cannot separate")
    added: list[AddedRuns] = Field(description="runs to add, the least effort first")
    assumed: list[Assumed] = Field(description="values that the simulation of the test day assumes")
    findings: list[FindingEntry] = Field(description="notes on the description and the fit")
