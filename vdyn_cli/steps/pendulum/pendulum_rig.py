"""How a wheel was hung and timed, as the user describes it."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from vdyn_cli.description.test_description import Channel, Reading, Si, Strict
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.pendulum.pendulum_inertia import STILL, Period

Mass = Annotated[Given, Si("kg", 0.01, 500)]
Length = Annotated[Given, Si("m", 1e-3, 20)]
Time = Annotated[Given, Si("s", 0.01, 1000)]

HAND = 0.2  # s, a stopwatch in a hand, start and stop together
STANDARD_GRAVITY = Given(9.80665, 0.01)  # anywhere between equator and pole, sea and mountain
NEEDS = {
    "compound": ("mass", "pivot_distance"),
    "bifilar": ("mass", "separation", "length"),
    "torsional": (),
}


class Bar(Strict):
    """A round bar of known inertia that was hung on the torsion rod across its axis, and its period."""

    mass: Mass
    length: Length
    diameter: Length
    period: Time


class Timing(Strict):
    """A stopwatch's readings, each over ``count`` whole swings."""

    count: int = Field(ge=1, le=100_000)
    durations: list[Time] = Field(min_length=1)


class Rig(Strict):
    """The pendulum: ``kind`` and its lengths, and a period, timed swings, or a recording.

    ``pivot_distance`` is pivot to axle; ``separation`` that of the two cords, ``length`` theirs; ``amplitude`` that of
    the timed swings.
    """

    kind: Literal["compound", "bifilar", "torsional"]
    mass: Mass | None = None
    pivot_distance: Length | None = None
    separation: Length | None = None
    length: Length | None = None
    torsional_stiffness: Annotated[Given, Si("N m/rad", 1e-3, 1e6)] | None = None
    calibration: Bar | None = None
    gravity: Annotated[Given, Si("m/s^2", 9.7, 9.9)] = STANDARD_GRAVITY
    period: Time | None = None
    timing: Timing | None = None
    amplitude: Annotated[Given, Si("rad", 0, 1.2)] | None = None
    log: str | None = None
    channels: dict[Literal["time", "angle", "angular_rate"], Channel] = Field(default_factory=dict)
    reading: Reading = Reading()

    @model_validator(mode="after")
    def _complete(self) -> Rig:
        """Everything that the kind needs, and one way to the period."""
        missing = [f"'{name}'" for name in NEEDS[self.kind] if getattr(self, name) is None]
        if self.kind == "torsional" and (self.torsional_stiffness is None) == (self.calibration is None):
            missing.append("one of 'torsional_stiffness' and 'calibration'")
        if sum(way is not None for way in (self.period, self.timing, self.log)) != 1:
            missing.append("one of 'period', 'timing' and 'log'")
        if self.log is not None and ("time" not in self.channels or len(self.channels) < 2):
            missing.append("'channels' with 'time' and 'angular_rate' or 'angle'")
        if missing:
            raise PydanticCustomError("pendulum", "a {kind} pendulum needs {missing}",
                                      {"kind": self.kind, "missing": ", ".join(missing)})  # fmt: skip
        return self

    def hung(self) -> dict[str, Given]:
        """What was measured of the rig, by the names that the inertia's formula uses."""
        if self.kind == "torsional":
            if self.calibration is not None:
                bar = self.calibration
                return {f"bar_{name}": getattr(bar, name) for name in ("mass", "length", "diameter", "period")}
            names: tuple[str, ...] = ("torsional_stiffness",)
        else:
            names = (*NEEDS[self.kind], "gravity")
        return {name: getattr(self, name) for name in names}

    def geometry(self) -> dict[str, float]:
        """What the swing's model asks for."""
        if self.kind != "bifilar" or self.separation is None or self.length is None:
            return {}
        half = self.separation.value / 2
        return {"half_spacing": half, "cord_length": self.length.value, "gravity": self.gravity.value}

    def stated_period(self) -> tuple[Period, list[Finding]]:
        """The period that was given or timed, with what is doubtful about it."""
        findings = []
        amplitude = self.amplitude or STILL
        if self.amplitude is None and self.kind != "torsional":
            what = "the amplitude of the timed swings is not given, so the period is taken for that of small swings"
            remedy = "add 'amplitude: 5 deg'; at 10 deg the period is 0.2 % long"
            findings.append(Finding("pendulum", what, "", remedy))
        if self.timing is None:
            assert self.period is not None
            if self.period.std == 0:
                findings.append(Finding("pendulum.period", "is given without a standard deviation and taken as exact"))
            return Period(self.period, math.inf, amplitude), findings
        period, degrees, assumed = _timed(self.timing)
        if assumed:
            what = f"one reading without a standard deviation: {HAND} s is assumed, as of a stopwatch in a hand"
            findings.append(Finding("pendulum.timing", what, "", "time the swings several times"))
        return Period(period, degrees, amplitude), findings


def _timed(timing: Timing) -> tuple[Given, float, bool]:
    """Mean period, degrees of freedom behind its standard deviation, and whether that had to be assumed."""
    durations = np.array([d.value for d in timing.durations])
    mean = float(durations.mean()) / timing.count
    stated = math.hypot(*(d.std for d in timing.durations)) / durations.size
    if durations.size == 1:
        assumed = stated == 0
        return Given(mean, (HAND if assumed else stated) / timing.count), math.inf, assumed
    scatter = float(durations.std(ddof=1)) / math.sqrt(durations.size)
    if scatter >= stated:
        return Given(mean, scatter / timing.count), float(durations.size - 1), False
    return Given(mean, stated / timing.count), math.inf, False
