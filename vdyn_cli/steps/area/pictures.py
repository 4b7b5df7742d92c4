"""Reading the pictures that a description names, and the place of the box in them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from vdyn_cli.io.picture import read_gray
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.area.spec import AreaSpec, ReferenceBox


@dataclass(frozen=True)
class Pictures:
    """The photo and its masks, None where not given; gray levels (rows, columns), 0 to 1."""

    photo: Array
    mask: Array | None
    exclude: Array | None


ALIKE = 1.1  # ratio of the scales across and down: lenses and skewed cameras reach 1.03, wrong lengths more


class BoxEdges(NamedTuple):
    """The box in the picture, pixels from the upper left corner."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def across(self) -> float:
        """Width in pixels."""
        return self.right - self.left

    @property
    def down(self) -> float:
        """Height in pixels."""
        return self.bottom - self.top


def load_pictures(spec: AreaSpec, folder: Path, logs: tuple[Log, ...]) -> tuple[Pictures, tuple[Path, ...]]:
    """Read the pictures, which must have the same size, and return them with their paths.

    Parameters
    ----------
    folder : of the description. logs : not used, because the step reads none.

    Raises
    ------
    InputError : every problem of the pictures at once.
    """
    findings: list[Finding] = []
    read: dict[str, Array] = {}
    names = {"image": spec.image, "mask": spec.mask, "exclude_mask": spec.exclude_mask}
    files = {key: folder / name for key, name in names.items() if name is not None}
    for key, file in files.items():
        try:
            read[key] = read_gray(file, key)
        except InputError as error:
            findings.extend(error.findings)
    for key, other in read.items():
        if "image" in read and other.shape != (shape := read["image"].shape):
            got = f"{other.shape[1]} x {other.shape[0]}, photo {shape[1]} x {shape[0]}"
            findings.append(Finding(key, "differs in size from the photo", got, "paint it on a copy of the photo"))
    raise_all(findings)
    return Pictures(read["image"], read.get("mask"), read.get("exclude_mask")), tuple(files.values())


def box_edges(box: ReferenceBox, photo: Array) -> BoxEdges:
    """The box in the photo (rows, columns); edges that the description omits are those of the photo.

    Raises
    ------
    InputError : the edges have the wrong order or lie outside the picture; the box's size does not fit its edges.
    """
    rows, columns = photo.shape
    left, right = (float(e if e is not None else default) for e, default in ((box.left, 0), (box.right, columns)))
    top, bottom = (float(e if e is not None else default) for e, default in ((box.top, 0), (box.bottom, rows)))
    if not (0 <= left < right <= columns and 0 <= top < bottom <= rows):
        got = f"left {left:g}, top {top:g}, right {right:g}, bottom {bottom:g} in {columns} x {rows}"
        raise InputError(Finding("box", "does not lie in the picture", got, "pixels count from the upper left corner"))
    edges = BoxEdges(left, top, right, bottom)
    scale_x, scale_y = box.width.value / edges.across, box.height.value / edges.down  # m per pixel
    if not 1 / ALIKE < scale_x / scale_y < ALIKE:
        got = f"{1000 * scale_x:.3g} mm per pixel across, {1000 * scale_y:.3g} mm down"
        remedy = "pixels are square: check width and height of the box, and its edges in the picture"
        raise InputError(Finding("box", "its size and its edges contradict each other", got, remedy))
    return edges
