"""The YAML model of a wheel-inertia test."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.quantity_field import Si, Strict
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.pendulum.pendulum_rig import Rig


class InertiaSettings(Strict):
    """Integration, and standard deviations of the sensors' zeros (0.1 % of full scale) and gains."""

    window: Annotated[Given, Si("s", 0.02, 5)] = Field(Given(0.25), description="length of an integration window, s")
    torque_zero: Annotated[Given, Si("N m", 1e-3, 500)] = Field(
        Given(4.0), description="standard deviation of the hub torque's zero, N m"
    )
    force_zero: Annotated[Given, Si("N", 1e-3, 5_000)] = Field(
        Given(24.0), description="standard deviation of the hub force's zero, N"
    )
    gain_std: Annotated[Given, Si("", 0, 0.1)] | None = Field(
        None,
        description="standard deviation of the torque's gain, on the road relative to the force's, 0.001 for 0.1 %; "
        "default: 0 on the road, 0.5 % on a stand",
    )
    stand_inertia: Annotated[Given, Si("kg m^2", 0, 50)] = Field(
        Given(0.0), description="inertia of the parts of a stand that turn with the wheel (rotor, shaft, hub), kg m^2"
    )


class InertiaSpec(Description):
    """The description of a wheel-inertia test: runs on the road, a pendulum, or both; or a free wheel on a stand."""

    manoeuvre: Literal["road", "stand"] = Field(
        "road", description="stand: the wheel turns freely and a torque at its hub spins it up and down"
    )

    settings: InertiaSettings = Field(InertiaSettings(), description="integration and accuracy of the sensors")
    pendulum: Rig | None = Field(None, description="suspension and timing of the wheel")
