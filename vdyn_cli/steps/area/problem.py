"""The area problem: a picture, its reference box and the camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Mask
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.area.pictures import BoxEdges, Pictures, box_edges
from vdyn_cli.steps.area.result import area_budget, box_at_widest_section, result_of, shadow_pixels
from vdyn_cli.steps.area.silhouette import LowContrastError, Silhouette, find_silhouette
from vdyn_cli.steps.area.spec import AreaSpec
from vdyn_cli.steps.contract import Problem

PLAUSIBLE = (0.5, 8.0)  # m^2: cars have 1.5 to 3; off by a factor of three, the box or the threshold is wrong
MASK_THRESHOLD = 0.5  # gray level of a painted mask, 1 white


@dataclass(frozen=True)
class AreaProblem(Problem):
    """A picture whose silhouette area is measured (see steps.contract.Problem); nothing is simulated or diagnosed.

    Parameters
    ----------
    edges : of the box in the picture. exclude : (rows, columns), True for pixels that do not count.
    """

    spec: AreaSpec
    pictures: Pictures
    edges: BoxEdges
    exclude: Mask

    def publish(self, added: AddedEffects = NO_EFFECTS) -> Result:
        """Count the silhouette's pixels, scale them by the box, and correct for perspective.

        Raises
        ------
        ResultError : car and background cannot be separated, or the area is not that of a road vehicle.
        """
        shape = self._silhouette()
        shadow = shadow_pixels(shape, self.spec, box_at_widest_section(self.spec, self.edges))
        budget = area_budget(shape.pixels, shape.edge_std, self.spec, self.edges, shadow)
        if not PLAUSIBLE[0] < budget.value < PLAUSIBLE[1]:
            remedy = "check the box's size and edges, and whether the car is 'dark' or 'bright'"
            got = f"{budget.value:.3g} m^2"
            raise ResultError(Finding(self.spec.image, "the area is not that of a road vehicle", got, remedy))
        return result_of(self.spec, self.pictures.photo, shape, self.edges, budget)

    def _silhouette(self) -> Silhouette:
        settings, mask = self.spec.settings, self.pictures.mask
        threshold = None if settings.threshold == "auto" else settings.threshold
        try:
            if mask is not None:
                return find_silhouette(mask, MASK_THRESHOLD, False, self.exclude)
            return find_silhouette(self.pictures.photo, threshold, settings.car == "dark", self.exclude)
        except ValueError as error:
            remedy = "set 'car: dark' or 'car: bright', a threshold, or give a mask"
            if isinstance(error, LowContrastError):
                remedy = "give a mask, or average the noise: halve the picture's width and height, and the box's edges"
            raise ResultError(Finding(self.spec.image, str(error), remedy=remedy)) from None


def prepare(spec: AreaSpec, pictures: Pictures, known: Parameters) -> AreaProblem:
    """Locate the box in the picture and mark the excluded pixels. Reads no known parameters.

    Raises
    ------
    InputError : the box's edges have the wrong order or lie outside the picture.
    """
    exclude = np.zeros(pictures.photo.shape, dtype=bool)
    if pictures.exclude is not None:
        exclude = pictures.exclude > MASK_THRESHOLD
    for left, top, right, bottom in spec.settings.exclude:
        exclude[max(round(top), 0) : max(round(bottom), 0), max(round(left), 0) : max(round(right), 0)] = True
    return AreaProblem(spec, pictures, box_edges(spec.box, pictures.photo), exclude)
