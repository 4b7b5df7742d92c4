"""Where the driver lets go after holding a speed: rows before that belong to no coast-down.

Half a second of held speed at the start of a coast looks like no resistance at the highest speed. A held speed
wanders, so that neither its highest value nor its noise tells the release. The speed is fitted about it by two pieces,
with T the release::

    V(t) = V0 + p t                                t <= T
    V(t) = V0 + p t - c (t - T) + q (t - T)^2      t >  T
"""

from __future__ import annotations

import numpy as np

from vdyn_cli.inference.bins import cut
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log

BIN = 0.1  # s: a tenth of RELEASE
# m/s below the highest speed, within which the release lies; at most a third of the fall. A car coasts through it in 5
# to 20 s, over which its deceleration is a straight line in time.
DROP = 2.0
HELD = 0.25  # of that: drivers and cruise controls hold a speed within 0.5 m/s
# Of the deceleration after the release, to which a held speed may rise or fall: one that is held has 0, a coast 1, an
# acceleration -1 and less. A third, some 0.1 m/s^2, leaves room for a pedal that is held still on a slope of 1 %.
STEADY = 1.0 / 3.0
RELEASE = 1.0  # s, that pedal and clutch take; the release is known to a few tenths of it
FEWEST_BINS = 5  # on either side of the release: the three unknowns of a piece, and two more


def released(log: Log, smooth: Array, top: int, end: int) -> int:
    """The first index of the coast: a second after the driver lets go, or ``top`` of a log that begins with the coast.

    Parameters
    ----------
    smooth : (n,) m/s, the speed without noise. top, end : index of its highest value and of the end of its fall.
    """
    drop = min(DROP, float(smooth[top] - smooth[end]) / 3.0)
    if drop <= 0.0 or smooth[top] < smooth[: top + 1].max():  # it coasts already where it passes an upper limit
        return top
    falls, beyond = (int(np.flatnonzero(smooth[top : end + 1] <= smooth[top] - n * drop)[0]) for n in (1.0, 2.0))
    apart = np.flatnonzero(np.abs(smooth[:top] - smooth[top]) > HELD * drop)
    for first in (int(apart[-1]) + 1 if apart.size else 0, top):  # where it is held long, else behind an acceleration
        window = slice(first, top + beyond + 1)
        bins = cut(log.time[window], BIN)
        found = _breakpoint(bins.time, bins.mean(log["speed"][window]), float(log.time[top + falls]))
        if found is not None:
            break
    if found is None and log.time[top] - log.time[0] < RELEASE:
        return top
    release = max(float(log.time[top]), found or -np.inf)
    return min(int(np.searchsorted(log.time, release + RELEASE)), end)


def _breakpoint(time: Array, speed: Array, latest: float) -> float | None:
    """The release, s; None where no steady speed changes there into a fall.

    Parameters
    ----------
    time, speed : (n,) s and m/s. latest : s, that is tried.
    """
    best, fit = np.inf, None
    tried = [k for k in range(FEWEST_BINS, time.size - FEWEST_BINS) if time[k] <= latest]
    for k in tried:
        after = np.maximum(time - time[k], 0.0)
        design = np.column_stack([np.ones_like(time), time - time[k], after, after**2])
        values = np.linalg.lstsq(design, speed, rcond=None)[0]
        left = float(np.sum((speed - design @ values) ** 2))
        if left < best:
            best, fit = left, (float(time[k]), float(values[1]), -float(values[1] + values[2]))
    if fit is None or fit[0] in (time[tried[0]], time[tried[-1]]):
        return None
    at, steady, falling = fit
    return at if falling > 0.0 and abs(steady) < STEADY * falling else None
