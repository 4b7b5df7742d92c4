"""The description of a tire test."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from vdyn_cli.description.test_description import Si, Strict, TestSpec
from vdyn_cli.quantities.quantity import Given


class TireSettings(Strict):
    """Which samples count: slip means nothing at crawling speed, friction nothing without load."""

    minimum_speed: Annotated[Given, Si("m/s", 0.1, 50)] = Field(
        Given(1.0), description="vehicle speed below which no slip is computed, m/s"
    )
    minimum_load: Annotated[Given, Si("N", 1, 50_000)] = Field(
        Given(300.0), description="vertical load below which samples are left out, N"
    )


class TireSpec(TestSpec):
    """The description of a tire test: slip sweeps, one log each."""

    settings: TireSettings = Field(TireSettings(), description="which samples of the sweeps count")
