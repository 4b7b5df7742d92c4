"""The place of a run on the road, from its logged position."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.arrays import Array

FEWEST_POSITIONS = 10  # rows with a position, whose mean is then known to a third of the receiver's noise
MISS = 0.1  # of the distance driven by which the position may differ from it: a trip meter differs by twice


def first_place(time: Array, speed: Array, position: Array, heading: float) -> float | None:
    """Road coordinate at a run's first row, m; None where the channel is not a road coordinate.

    x = h s + x0, with s the integral of the speed: x0 is the mean of x - h s.

    Parameters
    ----------
    time, speed, position : (n,) s, m/s, m; the position may be NaN in places.
    heading : +1 out, -1 back, 0 unknown. A position that rises on the way back (a trip meter) is not a coordinate.
    """
    there = np.isfinite(position)
    if heading == 0.0 or there.sum() < FEWEST_POSITIONS:
        return None
    along = heading * np.r_[0.0, np.cumsum(np.diff(time) * (speed[1:] + speed[:-1]) / 2)]
    offset = (position - along)[there]
    distance = float(np.ptp(along[there]))
    if distance <= 0.0 or float(np.ptp(offset)) > MISS * distance:
        return None
    return float(offset.mean())


def road_ends(places: Sequence[tuple[float, float, float]]) -> tuple[float, float]:
    """First and last road coordinate, m, of runs, each (first coordinate m, heading, distance driven m)."""
    every = [x + share * h * s for x, h, s in places for share in (0.0, 1.0)]
    return min(every), max(every)


def contradicting_position(rise: Sequence[float], headings: Sequence[float]) -> tuple[int, ...]:
    """Runs whose stated direction the logged position contradicts.

    A position that rises in some runs and falls in others is a coordinate of the road, and falls in all runs back or in
    all runs out: whichever most runs say, and rising out where they are undecided. One that only rises is a trip meter.

    Parameters
    ----------
    rise : m, of the position in each run. headings : +1 out, -1 back, 0 unknown.
    """
    ways = np.sign(rise)
    if not (np.any(ways > 0) and np.any(ways < 0)):
        return ()
    agreed = ways * np.asarray(headings, dtype=float)
    usual = -1.0 if agreed.sum() < 0 else 1.0
    return tuple(int(i) for i in np.flatnonzero(agreed == -usual))
