"""What a backend provides: many steps at once, on contiguous arrays of doubles."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Kernel(Protocol):
    """Machine code, or its stand-in, for the steps of one graph with K tangent lanes (K = 0: values alone)."""

    lanes: int
    rows: int

    def __call__(
        self,
        n: int,
        x: Array,
        u: Array,
        dt: Array,
        p: Array,
        x_tangents: Array,
        p_tangents: Array,
        readings: Array,
        reading_tangents: Array,
    ) -> None:
        """Advance ``n`` <= rows steps in place.

        Shapes: x (n+1, states) with row 0 given; u (n+1, inputs); dt (n,); p (constants,); x_tangents (n+1, states, K)
        with row 0 given; p_tangents (constants, K); readings (n, readings), taken at the start of each step, and
        reading_tangents (n, readings, K). All C-contiguous: the one door that calls this has checked them.
        """
        ...
