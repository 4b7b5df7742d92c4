"""What a diagnosis found: one typed object from the detection to the JSON, the report and the pipeline's page.

The field names are the keys of ``diagnosis`` in a result's JSON, which scripts depend on.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict

Verdict = Literal["adequate", "named", "ambiguous", "unknown", "not_testable", "data_fault"]


def _read(value: Any) -> Any:
    """JSON has no number that is not finite: it is written as null and read as NaN."""
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
    """The independent units behind the test: blocks of runs or whole runs.

    ``units`` counts them, ``stated`` of them are values known beforehand, ``worth`` is the effective number, and
    ``smallest_p`` the smallest p value that their signs can give.
    """

    unit: str
    units: int
    stated: int
    worth: Number
    smallest_p: Number


class Cause(Record):
    """An effect that was named, or taken into the model because the description requests it.

    ``biased`` is by how much each published parameter was off without the effect.
    """

    effect: str
    label: str
    unknowns: dict[str, Amplitude]
    p_value: float | None
    visibility: Number
    sensor: bool
    lasts: bool
    biased: dict[str, Number]


class NotTestable(Record):
    """A candidate effect that these data cannot show, and what it would do to the parameters if it had ``size``."""

    effect: str
    because: str
    size: Number
    unit: str
    would_bias: dict[str, Number]


class Gain(Record):
    """Held-out error before and after the extension; ``interval95`` is that of before less after, in ``unit``."""

    metric: str
    unit: str
    before: Number
    after: Number
    interval95: tuple[Number, Number]
    share_of_explainable: Number
    certain: bool
    held_out: bool
    folds: int


class WorstSegment(Record):
    """Where in a run the baseline is most wrong: the mean error of a segment, and its ratio to the noise level."""

    run: str
    channel: str
    segment: str
    size: Number
    unit: str
    over_noise: Number


class Ranked(Record):
    """A candidate effect alone: its score test in standard errors, and what a fit with it leaves."""

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


class Diagnosis(Record):
    """The whole diagnosis of one step.

    ``ambiguous`` holds sets of which one effect each makes the answer. ``doubt`` says why the result is in doubt
    whatever the verdict; ``not_extended`` why the model could not be extended.
    """

    verdict: Verdict
    sentence: str
    p_value: float | None = None
    evidence: Evidence | None = None
    causes: tuple[Cause, ...] = ()
    extended: tuple[str, ...] = ()
    ambiguous: tuple[tuple[str, ...], ...] = ()
    not_testable: tuple[NotTestable, ...] = ()
    gain: Gain | None = None
    where: tuple[WorstSegment, ...] = ()
    ranking: tuple[Ranked, ...] = ()
    next_test: tuple[NextTest, ...] = ()
    doubt: str = ""
    not_extended: str = ""
