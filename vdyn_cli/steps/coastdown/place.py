"""Where on the road a run took place, from its logged position."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FEWEST = 10  # rows that hold a position
MISS = 0.1  # of the distance driven by which the position may miss it


def first_place(time: Array, speed: Array, position: Array, heading: float) -> float | None:
    """Road coordinate at a run's first row, m; None where the channel is no coordinate of a road.

    x = h s + x0, with s the integral of the speed: x0 is the mean of x - h s.

    Parameters
    ----------
    time, speed, position : (n,) s, m/s, m; the position may be NaN in places.
    heading : +1 out, -1 back, 0 unknown. A position that rises on the way back (a trip meter) is no coordinate.
    """
    there = np.isfinite(position)
    if heading == 0.0 or there.sum() < FEWEST:
        return None
    along = heading * np.r_[0.0, np.cumsum(np.diff(time) * (speed[1:] + speed[:-1]) / 2)]
    offset = (position - along)[there]
    distance = float(np.ptp(along[there]))
    if distance <= 0.0 or float(np.ptp(offset)) > MISS * distance:
        return None
    return float(offset.mean())


def stretch_of_road(places: Sequence[tuple[float, float, float]]) -> tuple[float, float]:
    """First and last road coordinate of runs, each (first coordinate, heading, m driven)."""
    ends = [x + h * s for x, h, s in places]
    every = [*(x for x, _, _ in places), *ends]
    return min(every), max(every)


def against_position(travelled: Sequence[float], headings: Sequence[float]) -> tuple[int, ...]:
    """Runs whose stated direction the logged position contradicts.

    A position that rises in some runs and falls in others is a coordinate of the road, and falls in all runs back or in
    all runs out: whichever most runs say, and rising out where they are undecided. One that only rises is a trip meter.

    Parameters
    ----------
    travelled : m, by which the position rose in each run. headings : +1 out, -1 back, 0 unknown.
    """
    ways = np.sign(travelled)
    if not (np.any(ways > 0) and np.any(ways < 0)):
        return ()
    agreed = ways * np.asarray(headings, dtype=float)
    usual = -1.0 if agreed.sum() < 0 else 1.0
    return tuple(int(i) for i in np.flatnonzero(agreed == -usual))
