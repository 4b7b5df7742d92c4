"""The interface of a backend: many steps per call, on contiguous arrays of doubles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

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
    """Machine code, or its fallback, for the steps of one graph with K >= k tangent directions for k unknowns."""

    directions: int
    rows: int

    # Seven parameters: the signature of the compiled function
    def __call__(self, n: int, z: Array, u: Array, dt: Array, p: Array, w: Array, trajectory: Array) -> None:
        """Compute the readings and advance one Runge-Kutta step, ``n`` <= rows times.

        All arrays are C-contiguous; the caller has checked them.

        Parameters
        ----------
        z : (states (K + 1),) [K derivatives of each state | states] before the first step; updated in place.
        u : (n + 1, inputs), linear over each step.
        dt : (n,) s; a step of length zero does not change the states.
        p : (constants,).
        w : (n, readings (K + 1)), output: the readings before each step, arranged as z.
        trajectory : (n, states), output: the states before each step.
        """
        ...
