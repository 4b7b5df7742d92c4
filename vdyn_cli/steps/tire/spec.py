"""The YAML model of a tire test."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.quantity_field import Si, Strict
from vdyn_cli.quantities.quantity import Given

ShapeFactor = Literal["tire_B", "tire_C", "tire_D", "tire_E"]


class TireSettings(Strict):
    """Limits of the used samples (slip is undefined at standstill, friction without load), and the curve."""

    minimum_speed: Annotated[Given, Si("m/s", 0.1, 50)] = Field(
        Given(1.0), description="vehicle speed below which no slip is computed, m/s"
    )
    minimum_load: Annotated[Given, Si("N", 1, 50_000)] | None = Field(
        None,
        description="vertical load below which samples are left out, N; default: a tenth of each sweep's largest loads",
    )
    # A wheel force sensor that is zeroed before each sweep drifts by 0.01 % of its 24 kN; a larger common zero of all
    # sweeps is a candidate effect.
    force_zero: Annotated[Given, Si("N", 0, 1000)] = Field(
        Given(3.0), description="standard deviation of the zero of the longitudinal force from sweep to sweep, N"
    )
    priors: dict[ShapeFactor, Annotated[Given, Si("", -20, 100)]] = Field(
        {}, description="priors of B, C, D and E, such as {tire_C: 1.32 +- 0.1}; may also be stated under vehicle"
    )
    shifts: bool = Field(
        False, description="true: the shifts Sh (of the slip) and Sv (of the friction) are unknowns of the curve"
    )
    peaks: Literal["one", "two"] = Field(
        "one", description="two: driving and braking have their own peak friction and stiffness factor, D and B"
    )


class TireSpec(Description):
    """The description of a tire test: slip sweeps, one log each."""

    settings: TireSettings = Field(TireSettings(), description="used samples of the sweeps, and options of the curve")
