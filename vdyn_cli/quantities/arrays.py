"""Types of arrays: numbers, truth values, indices; and the cumulative integral."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Rows = NDArray[np.intp]  # indices of rows


def cumulative_integral(x: Array, y: Array) -> Array:
    """Integral of y (n,) over x (n,) from the first point to each point, (n,), by the trapezoidal rule."""
    return np.concatenate([[0.0], np.cumsum(np.diff(x) * (y[1:] + y[:-1]) / 2.0)])
