"""The YAML model of a half-shaft test."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from vdyn_cli.description.description_model import Description, Run
from vdyn_cli.description.quantity_field import Si, Strict, si
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.pendulum.pendulum_rig import Bar

SideName = Literal["left", "right"]
SIDES: tuple[SideName, ...] = ("left", "right")
SOLID = Given(0.0)
LONGEST_DELAY = 1.0  # s: telemetry takes a few hundredths; a longer delay is a wrong unit


class SectionSpec(Strict):
    """A section of shaft between two steps of its diameter."""

    outer_diameter: Annotated[Given, Si("m", 1e-3, 0.5)] = Field(description="outside diameter, m")
    inner_diameter: Annotated[Given, Si("m", 0, 0.5)] = Field(SOLID, description="inner diameter, m; 0 if solid")
    length: Annotated[Given, Si("m", 1e-4, 5)] = Field(description="length along the shaft, m")
    end_diameter: Annotated[Given, Si("m", 1e-3, 0.5)] | None = Field(
        None, description="outside diameter at the other end, m, where the section tapers"
    )

    @model_validator(mode="after")
    def _has_a_wall(self) -> SectionSpec:
        thinnest = min(d.value for d in (self.outer_diameter, self.end_diameter or self.outer_diameter))
        if self.inner_diameter.value >= thinnest:
            raise PydanticCustomError("section", "the inner diameter is not smaller than the outer one")
        return self


class ShaftRun(Run):
    """A tip-in or twist log of one shaft."""

    side: SideName = Field(description="side of the shaft, left or right")


class ShaftSettings(Strict):
    """Conversion of the channels to twist and torque of the shaft."""

    gear_ratio: Annotated[Given, Si("", 0.05, 100)] = Field(
        Given(1.0), description="turns of the channels motor_speed and motor_angle per turn of the wheel"
    )
    torque_gain: Annotated[Given, Si("", 0, 0.1)] = Field(
        Given(0.0), description="standard deviation of the torque sensor's gain, 0.001 for 0.1 %"
    )
    torque_delay: Annotated[Given, Si("s", -LONGEST_DELAY, LONGEST_DELAY)] | None = Field(
        None,
        description="delay of the torque relative to twist and speeds, such as 0 +- 0.05 ms; if not stated, 0 with a "
        "standard deviation of half a sampling interval",
    )


class ShaftSpec(Description):
    """The description of a half-shaft test: drawing, a bar hung on the shaft, tip-in logs, or several of them."""

    runs: list[ShaftRun] = Field(default_factory=list, description="tip-in or twist logs")  # type: ignore[assignment]
    sections: dict[SideName, list[SectionSpec]] = Field(
        default_factory=dict, description="the drawing of each side, its sections in series"
    )
    shear_modulus: Annotated[Given, si(PARAMETERS["shear_modulus"])] | None = Field(
        None, description="of the shafts' steel, Pa; else the vehicle's, else 79.3 +- 0.8 GPa"
    )
    pendulum: dict[SideName, Bar] = Field(
        default_factory=dict, description="for each side, a bar of known inertia that oscillated on the shaft"
    )
    settings: ShaftSettings = Field(ShaftSettings(), description="gear ratio and gain of the torque")
