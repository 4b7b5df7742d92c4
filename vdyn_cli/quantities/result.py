"""The result of a step: parameters, fit summary, and the figures and tables of its report.

Figures are data; the report draws them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from vdyn_cli.quantities.data_quality import DataQuality
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log_names import log_of
from vdyn_cli.quantities.parameters import Estimate, Parameters, wider_than_value

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from vdyn_cli.quantities.arrays import Array
    from vdyn_cli.quantities.diagnosis import Diagnosis


@dataclass(frozen=True)
class Comparison:
    """One run of one channel, measured against simulated; the standard figure of every step.

    ``x`` is the abscissa (time, slip); ``baseline`` is the simulation before the model was extended; ``used`` marks the
    samples that were fitted (None: all). Arrays are (n,); measured, simulated and baseline are in ``unit``.
    """

    run: str
    channel: str
    unit: str
    x: Array
    x_label: str
    measured: Array
    simulated: Array
    baseline: Array | None = None
    used: NDArray[np.bool_] | None = None
    held_out: bool = False


@dataclass(frozen=True)
class Series:
    """One line, set of points, band (between ``y`` and ``y2``) or set of bars of a figure.

    ``error`` is the half-width of error bars; ``role`` determines the color.
    """

    label: str
    x: Array
    y: Array
    kind: Literal["line", "points", "band", "bars", "step"] = "line"
    y2: Array | None = None
    error: Array | None = None
    role: Literal["measured", "simulated", "baseline", "residual", "accent", "muted", "reference"] = "measured"


@dataclass(frozen=True)
class Figure:
    """A figure as data; the caption says what it shows and how good and bad results look."""

    key: str
    title: str
    caption: str
    x_label: str
    y_label: str
    series: tuple[Series, ...]
    equal_axes: bool = False
    image: NDArray[np.uint8] | None = None  # (rows, columns, 3), drawn behind the series in pixel coordinates


@dataclass(frozen=True)
class Table:
    """A table; the cells are text with final units and digits."""

    key: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""


Restate = Callable[[Mapping[str, Estimate], Mapping[str, Any]], str]  # (parameters, extra) -> closing sentence
MISFIT = 2.5  # rms over noise floor above which the model is in doubt; the diagnosis' policy has the reason


@dataclass(frozen=True)
class FitSummary:
    """Quality of the fit: ``rms`` of the residual and ``noise_floor`` in ``unit`` of the fitted channel.

    ``cause`` is what the step found to be wrong with the runs where that makes the residual, a phrase.
    """

    runs: tuple[str, ...]
    rms: float
    noise_floor: float
    unit: str
    unknowns: tuple[str, ...]
    interval_unit: str = ""  # "run" or "block": the independent unit behind the intervals
    interval_units: int = 0
    held_out_rms: float | None = None
    warnings: tuple[str, ...] = ()
    cause: str = ""

    @property
    def run_count(self) -> int:
        """Number of runs; the parts of one log count once, and a log that is listed twice counts twice."""
        parts = {log_of(name) for name in self.runs if log_of(name) != name}
        return len(parts) + sum(log_of(name) == name for name in self.runs)

    @property
    def misfit(self) -> str:
        """The message for a residual far above the noise floor, else empty."""
        if not self.rms > MISFIT * self.noise_floor > 0:
            return ""
        because = f"{self.cause}, so that " if self.cause else ""
        return f"{because}the rms residual is {self.rms / self.noise_floor:.0f} times the noise floor"


@dataclass(frozen=True)
class Result:
    """The outcome of one step.

    ``sentence`` is the result in one sentence; ``extra`` holds further numbers for the JSON (for example the road load
    in dynamometer units), by topic. ``amplitudes`` are the estimated unknowns of the effects that extend the model.
    ``refused`` says why the result is not published; it then has no parameters. ``withheld`` are parameters that the
    data do not determine, each with the reason. ``quality`` is that of the logs, with the cuts. ``restate`` writes
    ``sentence`` again for other intervals of the same parameters and ``extra``; None where it contains no intervals.
    ``contradicted``: a simple evaluation of the same logs differs from the result by more than the errors of both.
    """

    step: str
    sentence: str
    parameters: Parameters
    fit: FitSummary
    methods: str
    comparisons: tuple[Comparison, ...] = ()
    figures: tuple[Figure, ...] = ()
    tables: tuple[Table, ...] = ()
    findings: tuple[Finding, ...] = ()
    extra: Mapping[str, Any] = field(default_factory=dict)
    diagnosis: Diagnosis | None = None
    amplitudes: Mapping[str, Estimate] = field(default_factory=dict)
    refused: tuple[Finding, ...] = ()
    withheld: Mapping[str, str] = field(default_factory=dict)
    quality: DataQuality = field(default_factory=DataQuality)
    restate: Restate | None = field(default=None, compare=False)
    contradicted: bool = False

    @property
    def doubts(self) -> tuple[Finding, ...]:
        """The findings that are reasons to doubt the result, such as an implausible value."""
        return tuple(f for f in self.findings if f.doubt)

    @property
    def undetermined(self) -> list[str]:
        """The parameters that this step estimated and whose 95 % intervals are wider than their values."""
        return [n for n, e in self.parameters.items() if e.source == self.step and wider_than_value(n, e)]

    @property
    def determines(self) -> bool:
        """Whether the data determine at least one of the parameters that this step estimated."""
        return len(self.undetermined) < sum(e.source == self.step for e in self.parameters.values())
