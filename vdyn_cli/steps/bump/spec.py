"""The YAML model of a bump test."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from vdyn_cli.description.description_model import Channel, Description, Reading, Run
from vdyn_cli.description.quantity_field import Si, Strict
from vdyn_cli.quantities.quantity import Given


class BumpRun(Run):
    """One crossing or drop, with the position of the bump or the time of the release."""

    distance_front: Annotated[Given, Si("m", -100, 100_000)] | None = Field(
        None, description="distance from the log's start to the bump's near edge for the front axle, m"
    )
    distance_rear: Annotated[Given, Si("m", -100, 100_000)] | None = Field(
        None, description="distance from the log's start to the bump's near edge for the rear axle, m"
    )
    release: Annotated[Given, Si("s")] | None = Field(
        None, description="of a drop: time of the log at which the car is released, s; detected where not given"
    )


class ProfileColumns(Strict):
    """The columns of a measured profile."""

    distance: Channel = Field(
        Channel(column="distance [m]", unit="m"), description="column and unit of the distance along the road"
    )
    height: Channel = Field(
        Channel(column="height [m]", unit="m"), description="column and unit of the height above the road"
    )


class Obstacle(Strict):
    """The bump: height, width and shape, or a measured profile."""

    height: Annotated[Given, Si("m", 1e-3, 0.5)] | None = Field(None, description="largest height, m")
    width: Annotated[Given, Si("m", 0.02, 5)] | None = Field(None, description="length along the road, m")
    shape: Literal["haversine", "half_sine", "profile"] = Field("haversine", description="shape along the road")
    profile: str | None = Field(None, description="CSV file of a measured profile, relative to the description")
    columns: ProfileColumns = Field(ProfileColumns(), description="columns of the measured profile")
    reading: Reading = Field(Reading(), description="how the file of the measured profile is read")

    @model_validator(mode="after")
    def _one_kind(self) -> Obstacle:
        measured = self.profile is not None
        if measured != (self.shape == "profile"):
            raise PydanticCustomError("shape", "'shape: profile' and 'profile: <file>.csv' belong together")
        if measured and (self.height is not None or self.width is not None):
            raise PydanticCustomError("size", "a measured profile has its own size: leave out 'height' and 'width'")
        if not measured and (self.height is None or self.width is None):
            raise PydanticCustomError("size", "a bump needs 'height' and 'width', or 'shape: profile' and 'profile'")
        return self


# Racelogic VBOX 3i: 0.1 km/h, which is 0.5 % of 20 km/h; optical sensors: 0.1 to 0.2 %. The wheelbase changes by 0.1 %
# when the suspension moves.
SPEED_SCALE = 1e-3


class BumpSettings(Strict):
    """Standard deviations of the sensors' zeros and of the speed's scale, and the place of the load sensors."""

    load_zero: Annotated[Given, Si("N", 1e-3, 5_000)] = Field(
        Given(15.0), description="standard deviation of the zero of one wheel's load, N"
    )
    acceleration_zero: Annotated[Given, Si("m/s^2", 1e-6, 5)] = Field(
        Given(0.05), description="standard deviation of the zero of the vertical acceleration, m/s^2"
    )
    pitch_rate_zero: Annotated[Given, Si("rad/s", 1e-8, 0.5)] = Field(
        Given(0.005), description="standard deviation of the zero of the pitch rate, rad/s"
    )
    speed_scale: Annotated[Given, Si("", 1e-9, 0.1)] = Field(
        Given(SPEED_SCALE), description="relative standard deviation of the speed's scale, without unit"
    )
    load_sensor: Literal["road", "hub"] = Field(
        "road", description="loads on the road, or at the hub, with 'wheel_mass' outside of the sensor"
    )
    rear_weight: Annotated[Given, Si("", 1e-6, 1e6)] | None = Field(
        None,
        description="weight w in the sum front^2 + w rear^2; without it noise weights each channel, no unit",
    )


class Drop(Strict):
    """The rig of a drop test."""

    rig: Literal["quarter_car", "half_car"] = Field(
        "quarter_car", description="quarter_car: one axle or wheel; half_car: both axles, whose body also pitches"
    )
    axle: Literal["front", "rear"] = Field("front", description="axle of a quarter car")
    wheels: Literal[1, 2] = Field(
        2,
        description="number of an axle's wheels on the rig, whose masses are stated; with 1, results of an axle are "
        "twice the rig's",
    )


class BumpSpec(Description):
    """The description of a bump test: the obstacle and its crossings, or a rig and its drops; one log each."""

    manoeuvre: Literal["crossing", "drop"] = Field(
        "crossing", description="drop: the car is released above its rest position and heights are logged; no bump"
    )
    bump: Obstacle | None = Field(None, description="the bump that is crossed")
    drop: Drop = Field(Drop(), description="the rig of a drop test")
    settings: BumpSettings = Field(BumpSettings(), description="uncertainty and place of the sensors")
    runs: list[BumpRun] = Field(default_factory=list, description="the crossings")  # type: ignore[assignment]

    @model_validator(mode="after")
    def _bump_or_drop(self) -> BumpSpec:
        if self.manoeuvre == "crossing" and self.bump is None:
            raise PydanticCustomError("bump", "'bump' is missing: add it, or 'manoeuvre: drop'")
        if self.manoeuvre == "drop" and self.bump is not None:
            raise PydanticCustomError("bump", "a drop has no bump: remove 'bump', or 'manoeuvre: drop'")
        return self

    @property
    def obstacle(self) -> Obstacle:
        """The bump of a crossing."""
        assert self.bump is not None
        return self.bump
