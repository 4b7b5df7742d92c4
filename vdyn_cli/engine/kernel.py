"""The interface of a backend: many steps per call, on contiguous arrays of doubles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from vdyn_cli.quantities.arrays import Array


@dataclass(frozen=True, eq=False)
class Seeds:
    """The derivatives that a kernel computes.

    Parameters
    ----------
    constants : (constants, k) derivatives of the constants to the k unknowns; k = 0: values only.
    seeded, live : indices of the constants and of the states whose derivatives can be nonzero; only these are computed.
    """

    constants: Array
    seeded: frozenset[int]
    live: frozenset[int]


class Kernel(Protocol):
    """Machine code, or its fallback, for the steps of one graph with K >= k tangent directions for k unknowns.

    Tangents are arranged in K / width groups: [rows of width derivatives of group 1 | of group 2 | ...].
    """

    directions: int
    width: int

    def steps(self, every: int) -> int:
        """Most steps of a call with readings before each ``every``-th; a multiple of it unless all rows are written."""
        ...

    # Seven parameters: the signature of the compiled function
    def __call__(self, every: int, z: Array, u: Array, dt: Array, p: Array, w: Array, trajectory: Array) -> None:
        """Advance n <= ``steps(every)`` Runge-Kutta steps; compute the readings before the first and each ``every``-th.

        All arrays are C-contiguous; the caller has checked them.

        Parameters
        ----------
        z : (states (K + 1),) [derivatives of the states | states] before the first step; updated in place.
        u : (n + 1, inputs), linear over each step.
        dt : (n,) s; a step of length zero does not change the states.
        p : (constants,).
        w : (n, readings (K + 1)), output: the readings before the steps, arranged as z; other rows may stay.
        trajectory : (n, states), output: the states before each step.
        """
        ...


def in_groups(derivatives: Array, directions: int, width: int) -> Array:
    """Derivatives (m, k), padded with zeros to K directions and arranged in groups, (K / width, m, width)."""
    m, k = derivatives.shape
    padded = np.zeros((m, directions))
    padded[:, :k] = derivatives
    groups = directions // width if width else 0
    return np.ascontiguousarray(padded.reshape(m, groups, width).transpose(1, 0, 2))


def from_groups(rows: Array, readings: int, directions: int, width: int) -> Array:
    """Rows (n, readings K) arranged in groups, as derivatives (readings, n, K).

    Parameters
    ----------
    directions : K, number of tangent directions. width : of a group, which divides K.
    """
    n = rows.shape[0]
    apart = rows.reshape(n, directions // width, readings, width)
    return apart.transpose(2, 0, 1, 3).reshape(readings, n, directions)
