"""The YAML model of a pendulum: how the wheel is suspended, and how its period was measured."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from vdyn_cli.description.description_model import Channel, Reading
from vdyn_cli.description.quantity_field import Si, Strict
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.pendulum.pendulum_inertia import STILL, MeasuredPeriod

Mass = Annotated[Given, Si("kg", 0.01, 500)]
Length = Annotated[Given, Si("m", 1e-3, 20)]
Time = Annotated[Given, Si("s", 0.01, 1000)]

HAND = 0.2  # s, standard deviation of a stopwatch in a hand, start and stop together (a reaction time)
EARTH = Given(GRAVITY, 0.01)  # m/s^2, anywhere between equator and pole, sea and mountain
NEEDS = {
    "compound": ("mass", "pivot_distance"),
    "bifilar": ("mass", "separation", "length"),
    "torsional": (),
}


class Bar(Strict):
    """A round bar of known inertia that was hung on the torsion rod across its axis, and its period."""

    mass: Mass = Field(description="mass of the bar, kg")
    length: Length = Field(description="length of the bar, m")
    diameter: Length = Field(description="diameter of the bar, m")
    period: Time = Field(description="period of its swing on the rod, s")

    def measured(self) -> dict[str, Given]:
        """Measured quantities of the bar, by the argument names of :func:`rod_stiffness`."""
        return {f"bar_{name}": getattr(self, name) for name in ("mass", "length", "diameter", "period")}


class Timing(Strict):
    """A stopwatch's readings."""

    count: int = Field(ge=1, le=100_000, description="whole swings in each reading")
    durations: list[Time] = Field(min_length=1, description="the readings, s")


class Rig(Strict):
    """A pendulum: how the wheel is suspended, and a period, timed swings, or a recording."""

    kind: Literal["compound", "bifilar", "torsional"] = Field(
        description="compound: on a pivot; bifilar: on two cords; torsional: on a rod"
    )
    mass: Mass | None = Field(None, description="mass of the suspended wheel, kg")
    pivot_distance: Length | None = Field(None, description="compound: from pivot to axle, m")
    separation: Length | None = Field(None, description="bifilar: between the two cords, m")
    length: Length | None = Field(None, description="bifilar: of the cords, m")
    torsional_stiffness: Annotated[Given, Si("N m/rad", 1e-3, 1e6)] | None = Field(
        None, description="torsional: of the rod, N m/rad"
    )
    calibration: Bar | None = Field(
        None, description="torsional: a bar that swung on the rod, in place of its stiffness"
    )
    gravity: Annotated[Given, Si("m/s^2", 9.7, 9.9)] = Field(EARTH, description="local gravity, m/s^2")
    period: Time | None = Field(None, description="period of a swing, s")
    timing: Timing | None = Field(None, description="swings timed with a stopwatch")
    amplitude: Annotated[Given, Si("rad", 0, 1.2)] | None = Field(None, description="of the timed swings, rad")
    log: str | None = Field(None, description="a recording of angle or angular rate")
    channels: dict[Literal["time", "angle", "angular_rate"], Channel] = Field(
        default_factory=dict, description="column and unit of each channel of the recording"
    )
    reading: Reading = Field(Reading(), description="how the recording is written")

    @model_validator(mode="after")
    def _complete(self) -> Rig:
        """Require every quantity of the kind, and exactly one source of the period."""
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
        """Measured quantities of the rig, by the names in the formula of the inertia."""
        if self.kind == "torsional":
            if self.calibration is not None:
                return self.calibration.measured()
            names: tuple[str, ...] = ("torsional_stiffness",)
        else:
            names = (*NEEDS[self.kind], "gravity")
        return {name: getattr(self, name) for name in names}

    def geometry(self) -> dict[str, float]:
        """Further parameters of the pendulum's model; empty except for a bifilar pendulum."""
        if self.kind != "bifilar" or self.separation is None or self.length is None:
            return {}
        half = self.separation.value / 2
        return {"half_spacing": half, "cord_length": self.length.value, "gravity": self.gravity.value}

    def stated_period(self) -> tuple[MeasuredPeriod, list[Finding]]:
        """The given or timed period, and findings about it. Assumes that there is no recording."""
        findings = []
        amplitude = self.amplitude or STILL
        if self.amplitude is None and self.kind != "torsional":
            what = "the amplitude of the timed swings is not given: the period is assumed to be that of small swings"
            remedy = "add 'amplitude: 5 deg'; at 10 deg the period is 0.2 % longer"
            findings.append(Finding("pendulum", what, "", remedy))
        if self.timing is None:
            assert self.period is not None
            if self.period.std == 0:
                what, remedy = "has no standard deviation and is assumed exact", "write it as '1.234 +- 0.002 s'"
                findings.append(Finding("pendulum.period", what, remedy=remedy))
            return MeasuredPeriod(self.period, math.inf, amplitude), findings
        period, degrees, assumed = _timed(self.timing)
        if assumed:
            what = f"one reading without a standard deviation: {HAND} s assumed (stopwatch by hand)"
            findings.append(Finding("pendulum.timing", what, "", "time the swings several times"))
        return MeasuredPeriod(period, degrees, amplitude), findings


def _timed(timing: Timing) -> tuple[Given, float, bool]:
    """Mean period, degrees of freedom of its standard deviation, and whether the latter is assumed."""
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
