"""Runs that decelerate like the runs of the opposite direction: their stated direction is probably wrong."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.arrays import Array

_OPPOSITE = {"out": "back", "back": "out"}
FEWEST = 2  # other runs of each direction, whose median is compared
NEAR = 1.0 / 3.0  # of the difference between the directions, up to which a run fits one of them: half-way fits neither


def fits_opposite(rates: Array, directions: Sequence[str | None], run: int) -> str | None:
    """The direction opposite to the run's own, if its deceleration is clearly closer to that of the runs there.

    Parameters
    ----------
    rates : deceleration of each run, (n,) m/s^2. directions : as stated. run : index of the run.
    """
    own, way = directions[run], np.array([str(d) for d in directions])
    other = _OPPOSITE.get(str(own))
    there, here = way == other, way == own
    here[run] = False
    if other is None or min(there.sum(), here.sum()) < FEWEST:
        return None
    to_there, to_here = (abs(float(rates[run] - np.median(rates[rows]))) for rows in (there, here))
    return other if to_there < NEAR * (to_there + to_here) else None


def direction_doubt(other: str) -> str:
    """The doubt of a run's direction, after the finding on its deceleration."""
    return f"it decelerates like the runs of direction '{other}', so check its direction first"
