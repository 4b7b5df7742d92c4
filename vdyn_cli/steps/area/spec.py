"""The YAML model of a silhouette picture."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.quantity_field import Si, Strict
from vdyn_cli.quantities.quantity import Given


class ReferenceBox(Strict):
    """The reference box: its true size, and its edges in the picture."""

    width: Annotated[Given, Si("m", 0.05, 20)] = Field(description="true width, m")
    height: Annotated[Given, Si("m", 0.05, 20)] = Field(description="true height, m")
    left: float | None = Field(
        None,
        description="column of its left edge, pixels from the left of the picture. Default: the edge of the picture",
    )
    top: float | None = Field(
        None, description="row of its upper edge, pixels from the top of the picture. Default: the edge of the picture"
    )
    right: float | None = Field(
        None,
        description="column of its right edge, pixels from the left of the picture. Default: the edge of the picture",
    )
    bottom: float | None = Field(
        None, description="row of its lower edge, pixels from the top of the picture. Default: the edge of the picture"
    )


class AreaSettings(Strict):
    """How the car is separated from its background, and where the camera stood."""

    threshold: Annotated[float, Field(gt=0, lt=1)] | Literal["auto"] = Field(
        "auto",
        description="gray level between car and background, 0 black to 1 white; auto: the level that separates the two "
        "best (Otsu's method)",
    )
    car: Literal["dark", "bright"] = Field(
        "dark", description="whether the car is darker or brighter than the background"
    )
    exclude: tuple[tuple[float, float, float, float], ...] = Field(
        (), description="rectangles that do not count, such as mirrors: left, top, right, bottom in pixels"
    )
    camera_distance: Annotated[Given, Si("m", 0.5, 10_000)] | None = Field(
        None, description="distance from the camera to the box, m"
    )
    vehicle_depth: Annotated[Given, Si("m", -20, 20)] = Field(
        Given(0.0), description="distance of the car's widest section behind the box, m"
    )


class AreaSpec(Description):
    """A silhouette's description."""

    image: str = Field(description="file of the picture: PNG, JPEG, BMP or TIFF")
    box: ReferenceBox = Field(description="reference box around or beside the car")
    mask: str | None = Field(None, description="file of a picture that is bright where the car is")
    exclude_mask: str | None = Field(None, description="file of a picture that is bright where pixels are left out")
    settings: AreaSettings = Field(AreaSettings(), description="settings of the area")
