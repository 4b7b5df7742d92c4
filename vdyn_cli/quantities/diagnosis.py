"""The result of a diagnosis: one typed object for the JSON, the report and the pipeline's page.

The field names are the keys of ``diagnosis`` in a result's JSON, on which scripts depend.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

Verdict = Literal["adequate", "named", "ambiguous", "unknown", "not_testable", "data_fault"]


def _read(value: Any) -> Any:
    """NaN for null: a number that is not finite is written as null."""
    return math.nan if value is None else value


Number = Annotated[float, BeforeValidator(_read)]


class Record(BaseModel):
    """A part of the diagnosis: frozen, and an unknown key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Amplitude(Record):
    """The estimate of one unknown of an effect, in its unit."""

    value: Number
    std: Number
    interval95: tuple[Number, Number]
    unit: str


class Evidence(Record):
    """The independent units of the test: blocks of runs or whole runs.

    ``units`` is their number, ``stated`` the number of those that are prior values, ``worth`` the effective number, and
    ``smallest_p`` the smallest p value of their sign-flip test.
    """

    unit: str
    units: int
    stated: int
    worth: Number
    smallest_p: Number


class PointChange(Record):
    """The change of the main output at one sample of a run; ``at`` says which."""

    run: str
    at: str
    change: Number


class Size(Record):
    """The size of a finding by three measures.

    ``change`` is the rms change of ``output``, in ``unit``, to compare with ``noise_floor``, the rms of noise alone;
    ``points`` is the change at stated samples. ``shifts_in_std`` is the shift of each parameter in its standard
    deviations. ``share_of_rms`` is (before - after) / (before - noise_floor) of the rms error of the output.
    """

    output: str
    unit: str
    change: Number
    noise_floor: Number
    points: tuple[PointChange, ...]
    shifts_in_std: dict[str, Number]
    share_of_rms: Number


class Remainder(Record):
    """The residual that an answer leaves: its share of the rms misfit, and the p value for noise alone.

    ``share_of_rms`` is the root of the whitened sum of squares that the strongest other candidate or free profile
    (``mostly``) would still explain beyond chance, over that of the whole misfit.
    """

    share_of_rms: Number
    p_value: float
    mostly: str | None


class Cause(Record):
    """An effect that the diagnosis accepted or that the description requests.

    ``biased`` is the error of each published parameter without the effect, SI; ``size`` is the effect's size.
    """

    effect: str
    label: str
    unknowns: dict[str, Amplitude]
    p_value: float | None
    visibility: Number
    sensor: bool
    lasts: bool
    biased: dict[str, Number]
    size: Size | None = None


class Detectable(Record):
    """The smallest amplitude of a candidate effect that these data would reveal nine times in ten, in its unit.

    ``would_bias`` holds the bias of the parameters by an effect of this amplitude that is not in the model.
    """

    effect: str
    label: str
    amplitude: Number
    unit: str
    would_bias: dict[str, Number] = Field(default_factory=dict)


class NotTestable(Record):
    """A candidate effect that these data cannot detect, and the bias of the parameters for the amplitude ``size``.

    ``size`` and the bias are unknown where the candidate lacks a channel.
    """

    effect: str
    because: str
    size: Number
    unit: str
    would_bias: dict[str, Number]


class Gain(Record):
    """Held-out error before and after the extension; ``interval95`` is that of before minus after, in ``unit``.

    ``share_of_explainable`` is (before - after) / (before - noise_floor), by rms: the share of the error that noise
    does not explain. ``refitted``: the errors are those of refitted models, not of predictions with the stated
    parameters. ``certain``: ``interval95`` lies above zero.
    """

    metric: str
    unit: str
    before: Number
    after: Number
    interval95: tuple[Number, Number]
    share_of_explainable: Number
    noise_floor: Number = math.nan
    refitted: bool = False
    certain: bool
    held_out: bool
    folds: int


class WorstSegment(Record):
    """The segment of a run with the largest error of the baseline: the mean error, and its ratio to the noise level."""

    run: str
    channel: str
    segment: str
    size: Number
    unit: str
    over_noise: Number


class Ranked(Record):
    """A candidate effect alone: its score test in standard errors, and the residual of a fit with it."""

    effect: str
    explains_t: Number
    visibility: Number
    left_p: float | None
    left_mostly: str | None
    unknowns: dict[str, Amplitude]


class NextTest(Record):
    """A manoeuvre, what it separates, the expected distance in standard errors, and the further runs it needs."""

    manoeuvre: str
    separates: tuple[str, ...]
    expected_t: float | None
    runs: int | None


class CurvePoint(Record):
    """The law of a part at one value of its coordinate, with a 95 % interval that holds for the point."""

    at: Number
    value: Number
    interval95: tuple[Number, Number]
    place: str = ""


class PartLaw(Record):
    """A law of the catalog, or a learned one, within the faulty part.

    ``share_of_curve`` is the share of the curve's rms deviation from the baseline's law that the law explains,
    ``share_of_rms`` the share of the rms error explained by the part; ``values`` is the law at the curve's points.
    """

    effect: str
    label: str
    share_of_curve: Number
    share_of_rms: Number
    values: tuple[Number, ...]


class FaultyPart(Record):
    """The part of the model that is at fault: the curve of an element or a sensor over one coordinate, of any form.

    Parameters
    ----------
    element : with its place, such as ``damper_rear``; the element alone where all its places are at fault.
    curve : the whole law, including the baseline's, over the range of the data; of a sensor, its error.
    baseline : the baseline's law at the same points, refitted without the part's addition.
    gauge : the component of the curve that the data leave undetermined, in words.
    share_of_rms : share of the rms error above the noise that the part explains.
    explains : whether the part explains the whole misfit.
    """

    element: str
    label: str
    coordinate: str
    coordinate_unit: str
    unit: str
    curve: tuple[CurvePoint, ...]
    baseline: tuple[Number, ...]
    gauge: str
    share_of_rms: Number
    explains: bool
    rivals: tuple[str, ...] = ()
    law: PartLaw | None = None


class LearnedLaw(Record):
    """A law estimated from the data: a table, or a formula that is not significantly worse.

    Parameters
    ----------
    form : table, step, saturation, line, power, bump, knee or periodic.
    formula : the addition to the baseline's law as a function of its coefficients.
    indistinguishable : other forms that these data cannot distinguish from it.
    table : the addition over the coordinate, with its interval.
    """

    effect: str
    element: str
    form: str
    formula: str
    coefficients: dict[str, Amplitude]
    indistinguishable: tuple[str, ...]
    table: tuple[CurvePoint, ...]


class Diagnosis(Record):
    """The whole diagnosis of one step.

    ``ambiguous`` holds sets of effects; one effect of each set belongs to the explanation. ``material`` says whether a
    significant finding matters (None: there is none), ``size`` its size, ``remainder`` the residual it leaves. ``part``
    is the part of the model at fault, ``learned`` its law where no law of the catalog suffices. ``detectable`` holds,
    for an adequate model, the smallest effects that the data would have revealed. ``doubt`` says why the result is in
    doubt whatever the verdict; ``not_extended`` why the model was not extended.
    """

    verdict: Verdict
    sentence: str
    p_value: float | None = None
    evidence: Evidence | None = None
    causes: tuple[Cause, ...] = ()
    extended: tuple[str, ...] = ()
    ambiguous: tuple[tuple[str, ...], ...] = ()
    not_testable: tuple[NotTestable, ...] = ()
    detectable: tuple[Detectable, ...] = ()
    gain: Gain | None = None
    size: Size | None = None
    remainder: Remainder | None = None
    material: bool | None = None
    where: tuple[WorstSegment, ...] = ()
    ranking: tuple[Ranked, ...] = ()
    next_test: tuple[NextTest, ...] = ()
    part: FaultyPart | None = None
    learned: LearnedLaw | None = None
    doubt: str = ""
    not_extended: str = ""
