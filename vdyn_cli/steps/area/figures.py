"""The figure of a frontal area."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.result import Figure, Series
from vdyn_cli.steps.area.pictures import BoxEdges
from vdyn_cli.steps.area.silhouette import Silhouette, outline

WIDEST = 800  # pixels of the picture in the report


def outline_and_box(photo: Array, shape: Silhouette, edges: BoxEdges) -> Figure:
    """The photo (rows, columns) with the outline of the silhouette and the box."""
    left, top, right, bottom = edges
    step = max(1, round(max(photo.shape) / WIDEST))
    small = (np.clip(photo[::step, ::step], 0, 1) * 255).astype(np.uint8)
    x, y = outline(shape.inside)
    box_x, box_y = np.array([left, right, right, left, left]), np.array([top, top, bottom, bottom, top])
    return Figure(
        "outline",
        "Outline and box",
        "The picture with the outline found and the reference box. Good: the outline follows the car, tires included, "
        "and nothing else. Bad: it follows a shadow under the car, includes the mirrors, or has dents at reflections.",
        "pixels",
        "pixels",
        (
            Series("outline", x[::3] / step, y[::3] / step, "points", role="accent"),
            Series("box", box_x / step, box_y / step, "line", role="reference"),
        ),
        True,
        np.repeat(small[:, :, None], 3, axis=2),
    )
