"""Where a run lies on the road, from its logged position."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.arrays import Array, cumulative_integral

FEWEST_POSITIONS = 10  # rows with a position: the mean is then accurate to a third of the receiver's noise
MISS = 0.1  # share of the driven distance by which the position may deviate: a trip meter deviates by twice of it


def first_place(time: Array, speed: Array, position: Array, heading: float) -> float | None:
    """Road coordinate at a run's first row, m; None where the channel is not a road coordinate.

    x = h s + x0, with s the integral of the speed: x0 is the mean of x - h s.

    Parameters
    ----------
    time, speed, position : (n,) s, m/s, m; the position may be NaN in places.
    heading : +1 out, -1 back, 0 unknown. A position that increases on the way back (trip meter) is not a coordinate.
    """
    there = np.isfinite(position)
    if heading == 0.0 or there.sum() < FEWEST_POSITIONS:
        return None
    along = heading * cumulative_integral(time, speed)
    offset = (position - along)[there]
    distance = float(np.ptp(along[there]))
    if distance <= 0.0 or float(np.ptp(offset)) > MISS * distance:
        return None
    return float(offset.mean())


def road_ends(places: Sequence[tuple[float, float, float]]) -> tuple[float, float]:
    """Lowest and highest road coordinate of all runs, m.

    Parameters
    ----------
    places : (coordinate at the first row m, heading, distance driven m) of each run.
    """
    every = [x + share * h * s for x, h, s in places for share in (0.0, 1.0)]
    return min(every), max(every)


def contradicting_position(rise: Sequence[float], headings: Sequence[float]) -> tuple[int, ...]:
    """Indices of the runs whose stated direction the logged position contradicts.

    A position that increases in some runs and decreases in others is a road coordinate. Whether it increases on the way
    out follows from the majority of the runs; in a tie it does. One that only increases is a trip meter.

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
