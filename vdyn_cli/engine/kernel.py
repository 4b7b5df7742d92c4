"""The interface of a backend: many steps per call, on contiguous arrays of doubles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from vdyn_cli.quantities.arrays import Array


@dataclass(frozen=True, eq=False)
class Seeds:
    """Which derivatives a kernel carries.

    Parameters
    ----------
    constants : (constants, k) derivatives of the constants to the unknowns; k = 0 for values alone.
    seeded : constants, and ``live`` : states, whose derivatives can differ from zero; of the others none are computed.
    """

    constants: Array
    seeded: frozenset[int]
    live: frozenset[int]


class Kernel(Protocol):
    """Machine code, or its stand-in, for the steps of one graph with K >= k tangent directions for k unknowns."""

    directions: int
    rows: int

    # Seven parameters: the signature of the compiled function
    def __call__(self, n: int, z: Array, u: Array, dt: Array, p: Array, w: Array, trajectory: Array) -> None:
        """Take the readings and advance one Runge-Kutta step, ``n`` <= rows times.

        All arrays are C-contiguous; the one door that calls this has checked them.

        Parameters
        ----------
        z : (states (K + 1),) [K derivatives of each state | states], given before the first step, left after the last.
        u : (n + 1, inputs), linear over each step.
        dt : (n,); a step of length zero leaves the states as they are.
        p : (constants,).
        w : (n, readings (K + 1)), written: before each step, arranged as z.
        trajectory : (n, states), written: before each step.
        """
        ...
