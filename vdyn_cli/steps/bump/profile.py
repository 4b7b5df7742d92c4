"""A bump's measured profile, with no more points than its shape needs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.physics.models.half_car import Points

Array = NDArray[np.float64]

FINEST = 1e-5  # m, height that need not be followed
MOST = 150  # points that a simulation carries


def thinned(position: Array, height: Array) -> tuple[Points, float]:
    """The fewest of the measured points whose straight lines follow the others, and how far off they are at most, m.

    Ramer and Douglas-Peucker: a stretch whose farthest point lies within the tolerance becomes one line. The tolerance
    begins at 0.01 mm and is doubled until at most 150 points are left.
    """
    tolerance = FINEST
    while True:
        kept = _corners(position, height, tolerance)
        if kept.size <= MOST:
            break
        tolerance *= 2
    off = float(np.max(np.abs(height - np.interp(position, position[kept], height[kept]))))
    start = height[0]
    points = tuple((float(x), float(h - start)) for x, h in zip(position[kept], height[kept], strict=True))
    return points, off


def _corners(position: Array, height: Array, tolerance: float) -> NDArray[np.intp]:
    kept = {0, position.size - 1}
    open_stretches = [(0, position.size - 1)]
    while open_stretches:
        first, last = open_stretches.pop()
        if last - first < 2:
            continue
        inner = slice(first + 1, last)
        line = np.interp(position[inner], position[[first, last]], height[[first, last]])
        away = np.abs(height[inner] - line)
        worst = first + 1 + int(np.argmax(away))
        if away.max() > tolerance:
            kept.add(worst)
            open_stretches += [(first, worst), (worst, last)]
    return np.array(sorted(kept), dtype=np.intp)
