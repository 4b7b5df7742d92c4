"""The YAML model of a coast-down."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator
from pydantic_core import PydanticCustomError

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.quantity_field import Si, Strict, si
from vdyn_cli.inference.gust_covariance import SOURCES
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.vocabulary import PARAMETERS

WIND_LIMIT = 16 / 3.6  # m/s, mean wind of a run; SAE J1263
FASTEST_START = 45.0  # m/s, 162 km/h: coast-downs begin below (J2263: 115 km/h; GTR 15: 140 km/h)
MINIMUM_LENGTH = 10.0  # s, of a part of a log: a shorter one contains too few gusts of 8 s to average them

Speed = Annotated[Given, Si("m/s", 0, 150)]
Windows = Literal["auto", "coast", "all", "powered"]


class FixedParameters(Strict):
    """Parameters that are given instead of estimated."""

    drag_coefficient: Annotated[Given, Si("", 0.05, 2.5)] | None = Field(
        None, description="drag coefficient, dimensionless; needs frontal_area"
    )
    drag_area: Annotated[Given, si(PARAMETERS["drag_area"])] | None = Field(None, description="drag area Cd A, m^2")
    rolling_resistance: Annotated[Given, Si("", 0.0005, 0.1)] | None = Field(
        None, description="rolling resistance coefficient, dimensionless"
    )

    @property
    def names(self) -> frozenset[str]:
        """The model parameters that are fixed; a drag coefficient fixes the drag area."""
        names = {"rolling_resistance"} if self.rolling_resistance else set()
        return frozenset(names | ({"drag_area"} if self.drag_area or self.drag_coefficient else set()))


class ReferenceConditions(Strict):
    """Conditions to which the road load is corrected."""

    temperature: Annotated[Given, Si("K", 203, 333)] = Field(Given(293.15), description="air temperature, K")
    pressure: Annotated[Given, Si("Pa", 40_000, 110_000)] = Field(Given(100_000.0), description="air pressure, Pa")
    mass: Annotated[Given, si(PARAMETERS["mass"])] | None = Field(
        None, description="certified mass where it differs from the mass as tested, kg"
    )


class Road(Strict):
    """The road that all runs share."""

    roughness: Annotated[Given, Si("", 0, 0.1)] | None = Field(
        None,
        description="unevenness of the road: least standard deviation of its slope that the intervals include, m/m; 0: "
        f"level road, {SOURCES['roughness'].typical:g} is usual. Estimated from the runs where it is not given",
    )
    profile: str | None = Field(
        None,
        description="path of a survey of the road, from the folder of this description: a table with columns position "
        "(m, the coordinate of the channel 'position'), and elevation (m) or grade (m/m or %), and their errors "
        "elevation_std or grade_std; it gives the channel 'grade'",
    )


class CoastdownSettings(Strict):
    """Which parts of the logs are fitted, with which model and noise."""

    speed_window: list[Speed] | None = Field(
        None,
        min_length=2,
        max_length=2,
        description="highest and lowest speed of the fitted part, m/s. Default: the whole coast",
    )
    windows: Windows = Field(
        "auto",
        description="coast: the fall through speed_window; all: the drive is measured and no brake is used; powered: "
        "only where the drive force is positive; auto: all where the drive force is measured, else coast",
    )

    @field_validator("speed_window", mode="before")
    @classmethod
    def _with_unit(cls, value: Any) -> Any:
        """Refuse plain numbers above the speeds of coast-downs in m/s: they are likely km/h."""
        numbers = [v for v in value if isinstance(v, (int, float))] if isinstance(value, list) else []
        if len(numbers) == 2 and max(numbers) > FASTEST_START:
            high, low = sorted(numbers, reverse=True)
            what = "plain numbers are m/s ({high} m/s is {kmh} km/h): write [{high} km/h, {low} km/h], highest first"
            raise PydanticCustomError(
                "unit", what, {"high": f"{high:g}", "low": f"{low:g}", "kmh": f"{3.6 * high:.0f}"}
            )
        return value

    @field_validator("speed_window")
    @classmethod
    def _not_empty(cls, value: list[Given] | None) -> list[Given] | None:
        if value and value[0].value == value[-1].value:
            what = "the highest and the lowest speed are the same: write two speeds, such as [70 km/h, 25 km/h]"
            raise PydanticCustomError("speed_window", what)
        return value

    minimum_length: Annotated[Given, Si("s", 2, 3600)] = Field(
        Given(MINIMUM_LENGTH), description="shortest part of a log that is fitted, s"
    )
    terms: Literal[2, 3] = Field(2, description="2: road load c0 + c2 V^2; 3: with c1 V")
    noise: Literal["gusts", "white"] = Field(
        "gusts", description="noise model; white: plain least squares, which assumes independent samples"
    )
    fix: FixedParameters = Field(FixedParameters(), description="parameters that are given instead of estimated")
    reference: ReferenceConditions = Field(ReferenceConditions(), description="conditions of the corrected road load")
    road: Road = Field(Road(), description="slope of the road that all runs share")
    wind_limit: Annotated[Given, Si("m/s", 0, 60)] = Field(
        Given(WIND_LIMIT), description="mean measured wind above which a run is left out, m/s"
    )
    crosswind: Annotated[Given, Si("m/s", 0, 60)] | None = Field(
        None,
        description="mean crosswind whose drag the intervals include, where no run states its own, m/s; estimated from "
        "the gusts where it is not given",
    )
    elevation_error: Annotated[Given, Si("m", 0.01, 100)] = Field(
        Given(5.0), description="standard deviation of the elevation at either end of a log, m"
    )
    mean_slope: Annotated[Given, Si("", 1e-5, 0.1)] = Field(
        Given(0.003),
        description="standard deviation of a log's net slope where no elevation is measured, dimensionless",
    )


class CoastdownSpec(Description):
    """A coast-down's description."""

    settings: CoastdownSettings = Field(CoastdownSettings(), description="settings of the coast-down")
