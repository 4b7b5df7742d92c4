"""The step ``area``: its description, its problem and its result."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from vdyn_cli.description.test_description import Si, Strict, TestSpec
from vdyn_cli.inference.uncertainty_budget import Budget, propagate
from vdyn_cli.io.picture import read_grey
from vdyn_cli.quantities.errors import Finding, InputError, ResultError, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import Figure, FitSummary, Result, Series, Table
from vdyn_cli.steps.area.silhouette import Silhouette, find_silhouette, outline
from vdyn_cli.steps.contract import Step, from_functions

Pixels = NDArray[np.float64]

CORNER = 0.5  # pixels, standard deviation of a box corner read off the picture
PLAUSIBLE = (0.5, 8.0)  # m^2


class Box(Strict):
    """The reference box: its true size, and its edges in the picture (the picture's own, where left out)."""

    width: Annotated[Given, Si("m", 0.05, 20)]
    height: Annotated[Given, Si("m", 0.05, 20)]
    left: float | None = None
    top: float | None = None
    right: float | None = None
    bottom: float | None = None


class AreaSettings(Strict):
    """How the car is told from its background, and where the camera stood."""

    threshold: Annotated[float, Field(gt=0, lt=1)] | Literal["auto"] = "auto"
    car: Literal["dark", "bright"] = "dark"
    exclude: tuple[tuple[float, float, float, float], ...] = ()  # left, top, right, bottom in pixels
    camera_distance: Annotated[Given, Si("m", 0.5, 10_000)] | None = None
    vehicle_depth: Annotated[Given, Si("m", -20, 20)] = Given(0.0)


class AreaSpec(TestSpec):
    """A silhouette's description; ``mask``: bright where the car is; ``exclude_mask``: bright what must not count."""

    image: str
    box: Box
    mask: str | None = None
    exclude_mask: str | None = None
    settings: AreaSettings = AreaSettings()


@dataclass(frozen=True)
class Pictures:
    """The photo, and the masks where there are any; (rows, columns), 0 to 1."""

    photo: Pixels
    mask: Pixels | None
    exclude: Pixels | None


def load(spec: AreaSpec, folder: Path, logs: tuple[Log, ...]) -> tuple[Pictures, tuple[Path, ...]]:
    """Read the pictures, which must be of one size.

    Raises
    ------
    InputError : whatever is wrong with them, all at once.
    """
    findings: list[Finding] = []
    read: dict[str, Pixels | None] = {}
    for key, name in (("image", spec.image), ("mask", spec.mask), ("exclude_mask", spec.exclude_mask)):
        read[key] = None
        if name is not None:
            try:
                read[key] = read_grey(folder / name, key)
            except InputError as error:
                findings.extend(error.findings)
    photo = read["image"]
    for key in ("mask", "exclude_mask"):
        other = read[key]
        if photo is not None and other is not None and other.shape != photo.shape:
            got = f"{other.shape[1]} x {other.shape[0]}, photo {photo.shape[1]} x {photo.shape[0]}"
            findings.append(Finding(key, "is not of the photo's size", got, "paint the mask on a copy of the photo"))
    raise_all(findings)
    assert photo is not None
    files = tuple(folder / n for n in (spec.image, spec.mask, spec.exclude_mask) if n is not None)
    return Pictures(photo, read["mask"], read["exclude_mask"]), files


def estimate(spec: AreaSpec, pictures: Pictures, known: Parameters) -> Result:
    """Count the silhouette's pixels, scale them by the box, and correct for perspective."""
    left, top, right, bottom = edges = _box_edges(spec.box, pictures.photo)
    shape = _silhouette(spec, pictures)
    budget = area_budget(shape.pixels, shape.edge_std, spec, edges)
    if not PLAUSIBLE[0] < budget.value < PLAUSIBLE[1]:
        remedy = "check the box's size and edges, and whether the car is 'dark' or 'bright'"
        got = f"{budget.value:.3g} m^2"
        raise ResultError(Finding(spec.image, "the area is not that of a road vehicle", got, remedy))
    share = shape.pixels / ((right - left) * (bottom - top))
    low, high = budget.interval95
    estimate_ = Estimate.of("frontal_area", budget.value, budget.std, (low, high), "area")
    sentence = (
        f"The frontal area is {budget.value:.3f} m^2 (95 %: {low:.3f} to {high:.3f}): the silhouette fills "
        f"{share:.1%} of the box of {spec.box.width.value * spec.box.height.value:.3f} m^2."
    )
    summary = FitSummary((spec.image,), float("nan"), float("nan"), "", ("frontal_area",))
    tables = (_numbers(shape, share, edges), _table(budget))
    return Result(
        "area", sentence, Parameters({"frontal_area": estimate_}), summary, METHODS,
        figures=(_picture(pictures.photo, shape, edges),), tables=tables, findings=_findings(spec, shape, edges),
        extra={"silhouette": {"pixels": shape.pixels, "share_of_box": share, "threshold": shape.threshold}},
    )  # fmt: skip


def _box_edges(box: Box, photo: Pixels) -> tuple[float, float, float, float]:
    """The box in pixels.

    Raises
    ------
    InputError : edges in the wrong order or outside the picture.
    """
    rows, columns = photo.shape
    given = (box.left, box.top, box.right, box.bottom)
    left, top, right, bottom = (
        float(default if edge is None else edge) for edge, default in zip(given, (0, 0, columns, rows), strict=True)
    )
    if not (0 <= left < right <= columns and 0 <= top < bottom <= rows):
        got = f"left {left:g}, top {top:g}, right {right:g}, bottom {bottom:g} in {columns} x {rows}"
        raise InputError(Finding("box", "does not lie in the picture", got, "pixels count from the upper left corner"))
    return left, top, right, bottom


def _silhouette(spec: AreaSpec, pictures: Pictures) -> Silhouette:
    photo = pictures.photo
    exclude = np.zeros(photo.shape, dtype=bool) if pictures.exclude is None else pictures.exclude > 0.5
    for left, top, right, bottom in spec.settings.exclude:
        exclude[max(round(top), 0) : max(round(bottom), 0), max(round(left), 0) : max(round(right), 0)] = True
    threshold = None if spec.settings.threshold == "auto" else spec.settings.threshold
    try:
        if pictures.mask is not None:
            return find_silhouette(pictures.mask, 0.5, False, exclude)
        return find_silhouette(photo, threshold, spec.settings.car == "dark", exclude)
    except ValueError as error:
        remedy = "set 'car: dark' or 'car: bright', a threshold, or give a mask"
        raise ResultError(Finding(spec.image, str(error), remedy=remedy)) from None


def area_budget(pixels: float, edge_std: float, spec: AreaSpec, edges: tuple[float, float, float, float]) -> Budget:
    """The area with what each input contributes to its uncertainty, m^2."""
    left, top, right, bottom = edges
    corner = CORNER * 2**0.5 if spec.box.left is not None or spec.box.top is not None else 0.0
    distance = spec.settings.camera_distance

    def formula(**x: float) -> float:
        stretch = (x["camera_distance"] + x["vehicle_depth"]) / x["camera_distance"] if distance is not None else 1.0
        scale = x["box_width"] / x["box_pixels_across"] * x["box_height"] / x["box_pixels_down"]
        return x["silhouette_pixels"] * scale * stretch**2

    inputs = {
        "silhouette_pixels": Given(pixels, edge_std),
        "box_width": spec.box.width,
        "box_height": spec.box.height,
        "box_pixels_across": Given(right - left, corner),
        "box_pixels_down": Given(bottom - top, corner),
    }
    if distance is not None:
        inputs |= {"camera_distance": distance, "vehicle_depth": spec.settings.vehicle_depth}
    units = dict.fromkeys(("box_width", "box_height", "camera_distance", "vehicle_depth"), "m")
    return propagate(formula, inputs, units)


def _findings(spec: AreaSpec, shape: Silhouette, edges: tuple[float, float, float, float]) -> tuple[Finding, ...]:
    found = []
    rows, columns = np.nonzero(shape.inside)
    if rows.min() == 0 or columns.min() == 0 or rows.max() == shape.inside.shape[0] - 1:
        found.append(Finding(spec.image, "the silhouette touches the picture's edge", remedy="is the car cut off?"))
    left, top, right, bottom = edges
    outside = columns.min() < left - 3 or columns.max() > right + 2 or rows.min() < top - 3 or rows.max() > bottom + 2
    if outside:
        remedy = "exclude mirrors and antennas; otherwise check the box's edges"
        found.append(Finding(spec.image, "the silhouette reaches beyond the box", remedy=remedy))
    if spec.settings.camera_distance is None:
        remedy = "give camera_distance and vehicle_depth: 0.3 m of depth at 30 m is 2 % of area"
        found.append(Finding(spec.image, "perspective is not corrected", remedy=remedy))
    if shape.dropped > 0.001:
        got = f"{shape.dropped:.2%} of the area"
        found.append(Finding(spec.image, "small pieces beside the car are left out", got, "look at the outline"))
    if shape.pieces > 1:
        found.append(Finding(spec.image, "the silhouette has several pieces", str(shape.pieces), "look at the outline"))
    return tuple(found)


def _numbers(shape: Silhouette, share: float, edges: tuple[float, float, float, float]) -> Table:
    left, top, right, bottom = edges
    rows = (
        ("silhouette", f"{shape.pixels:.0f} pixels"),
        ("box", f"{right - left:.1f} x {bottom - top:.1f} pixels"),
        ("share of the box", f"{share:.2%}"),
        ("threshold", f"{shape.threshold:.2f} of white"),
        ("contrast", f"{shape.contrast:.0f} x the noise of the grey levels"),
    )
    return Table("silhouette", "The silhouette", ("", ""), rows)


def _table(budget: Budget) -> Table:
    caption = "The largest contribution is what to measure better next time."
    return budget.table("budget", "Where the uncertainty comes from", "m²", caption)


def _picture(photo: Pixels, shape: Silhouette, edges: tuple[float, float, float, float]) -> Figure:
    left, top, right, bottom = edges
    step = max(1, round(max(photo.shape) / 800))
    small = (np.clip(photo[::step, ::step], 0, 1) * 255).astype(np.uint8)
    series = [
        Series("outline", x[::3] / step, y[::3] / step, "points", role="accent") for x, y in outline(shape.inside)
    ]
    box_x, box_y = np.array([left, right, right, left, left]), np.array([top, top, bottom, bottom, top])
    series.append(Series("box", box_x / step, box_y / step, "line", role="reference"))
    caption = (
        "The picture with the outline found and the reference box. Good: the outline follows the car, tyres included, "
        "and nothing else. Bad: it runs along a shadow under the car, holds the mirrors, or dents where paint shines."
    )
    image = np.repeat(small[:, :, None], 3, axis=2)
    return Figure("outline", "Outline and box", caption, "pixels", "pixels", tuple(series), True, image)


METHODS = (
    "Car and background separated by a threshold (Otsu's, unless given); pixels at the edge counted by where their "
    "grey level lies between smooth surfaces through the car's and the background's; scaled by the reference box; "
    "perspective corrected by the similarity of triangles. Uncertainty propagated to first order from the box, its "
    "corners, the camera's distance, and the place of the edge within the blur."
)

STEP = Step(
    name="area",
    spec=AreaSpec,
    required=(),
    optional=(),
    needs=(),
    gives=("frontal_area",),
    prepare=from_functions(estimate=estimate),
    load=load,
)
