"""The YAML model of a load-transfer test."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.quantity_field import Si, Strict
from vdyn_cli.quantities.quantity import Given


class CgSettings(Strict):
    """What the accelerometer measures, and how uncertain the load cells' zeros are."""

    accelerometer: Literal["gps", "body"] = Field(
        "gps",
        description="gps: rate of the antenna's speed; body: a sensor on the body, whose reading includes gravity "
        "when the body pitches",
    )
    load_zero: Annotated[Given, Si("N", 0, 5_000)] = Field(
        Given(15.0), description="standard deviation of the zero of one wheel's load, N"
    )


class CgSpec(Description):
    """The description of a load-transfer test: accelerate-and-brake runs, one log each."""

    settings: CgSettings = Field(CgSettings(), description="properties of the sensors")
