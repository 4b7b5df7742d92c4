"""Sentence, methods text and tables of a frontal area."""

from __future__ import annotations

from vdyn_cli.inference.uncertainty_budget import Budget
from vdyn_cli.quantities.result import Table
from vdyn_cli.steps.area.pictures import BoxEdges
from vdyn_cli.steps.area.silhouette import Silhouette

METHODS = (
    "A threshold (Otsu's of the picture without the background's unevenness, unless given) separates car and "
    "background. Pixels at the edge count by their gray "
    "level between smooth surfaces fitted to car and background. The reference box gives the scale; similar triangles "
    "correct the perspective. The uncertainty follows to first order from the box, its corners, the camera's "
    "distance, and the position of the edge within the blur."
)


def sentence(budget: Budget, share: float, box_area: float) -> str:
    """The headline: the area, and the share of the box (``box_area`` m^2) that the silhouette fills."""
    low, high = budget.interval95
    fills = f"fills {100 * share:.1f} % of" if share <= 1.0 else f"is {share:.2f} times"
    return (
        f"The frontal area is {budget.value:.3f} m^2 (95 %: {low:.3f} to {high:.3f}): the silhouette {fills} "
        f"the box of {box_area:.3f} m^2."
    )


def silhouette(shape: Silhouette, share: float, edges: BoxEdges) -> Table:
    """Table of the silhouette.

    Parameters
    ----------
    shape : the silhouette: its area (pixels), threshold and contrast of the gray levels.
    share : of the box's area that it fills, 0 to 1. edges : of the box, pixels.
    """
    rows = (
        ("silhouette", f"{shape.pixels:.0f} pixels"),
        ("box", f"{edges.across:.1f} x {edges.down:.1f} pixels"),
        ("share of the box", f"{100 * share:.2f} %"),
        ("threshold", f"{shape.threshold:.2f} of white"),
        ("contrast", f"{shape.contrast:.0f} x the noise of the gray levels"),
    )
    return Table("silhouette", "The silhouette", ("", ""), rows)
