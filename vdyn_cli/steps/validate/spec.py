"""The YAML description of a validation."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.quantity_field import Si, Strict
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.validate.drives.segments import SLOWEST


class WindowSettings(Strict):
    """Short windows instead of whole drives."""

    length: Annotated[Given, Si("s", 2, 3600)] = Field(Given(20.0), description="length of each window, s")
    powered: bool = Field(True, description="use only windows in which the drive torque is above zero throughout")
    slowest: Annotated[Given, Si("m/s", 0, 100)] = Field(
        Given(SLOWEST),
        description="use only windows that are faster than this, m/s: in towns, curves and cold tires add "
        "resistance that is not part of the road load",
    )


class ZeroSettings(Strict):
    """Standard deviations of sensors' zeros, which differ between drives."""

    acceleration: Annotated[Given, Si("m/s^2", 0, 3)] = Field(
        Given(0.02), description="standard deviation of the accelerometer's zero in each drive, m/s^2"
    )
    shaft_torque: Annotated[Given, Si("N m", 0, 200)] = Field(
        Given(2.0), description="standard deviation of each shaft torque sensor's zero in each drive, N m"
    )
    drive_torque: Annotated[Given, Si("N m", 0, 200)] = Field(
        Given(0.5), description="standard deviation of the drive torque sensor's zero in each drive, N m"
    )


class GainSettings(Strict):
    """Standard deviations of sensors' gains, the same in all drives."""

    speed: Annotated[Given, Si("", 0, 0.2)] = Field(
        Given(0.0005), description="relative standard deviation of the speed sensor's gain; 0.001 is 0.1 %"
    )
    shaft_torque: Annotated[Given, Si("", 0, 0.2)] = Field(
        Given(0.001), description="relative standard deviation of the shaft torque sensors' common gain; 0.001 is 0.1 %"
    )
    acceleration: Annotated[Given, Si("", 0, 0.2)] = Field(
        Given(0.01), description="relative standard deviation of the accelerometer's gain; 0.01 is 1 %"
    )


class DriveSettings(Strict):
    """Standard deviations of unrecorded slope and load of drives, for drives cut into windows."""

    slope: Annotated[Given, Si("", 0, 0.1)] = Field(
        Given(0.003), description="standard deviation of the mean slope of a drive (rise over run)"
    )
    load: Annotated[Given, Si("kg", 0, 10_000)] = Field(
        Given(0.0), description="standard deviation of the load beyond the stated mass, kg"
    )


class ValidateSettings(Strict):
    """Model, windows, step size, and uncertainties of sensors and drives."""

    model: Literal["vehicle", "road_load"] = Field(
        "vehicle", description="vehicle: all degrees of freedom (vdyn explain validate); road_load: a mass on a road"
    )
    driven: Literal["front", "rear", "both"] = Field("front", description="driven axle")
    differential: Literal["open", "locked"] = Field(
        "open",
        description="how the half-shafts of a driven axle are joined: open (equal torques) or locked (equal speeds)",
    )
    windows: WindowSettings | None = Field(
        None, description="cut the drives into short windows; left out: whole drives"
    )
    step: Annotated[Given, Si("s", 1e-5, 0.05)] | None = Field(
        None,
        description="longest integration step, s; left out: the longest accurate one, at most 2 ms (vehicle) or 50 ms "
        "(road_load)",
    )
    zeros: ZeroSettings = Field(ZeroSettings(), description="standard deviations of sensors' zeros")
    gains: GainSettings = Field(GainSettings(), description="standard deviations of sensors' gains")
    drives: DriveSettings = Field(
        DriveSettings(), description="standard deviations of slope and load, which differ between drives"
    )


class ValidateSpec(Description):
    """A validation's description."""

    settings: ValidateSettings = Field(ValidateSettings(), description="settings of the step validate")
