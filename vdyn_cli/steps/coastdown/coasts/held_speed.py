"""The instant at which the driver releases the pedal after holding a speed; rows before it are not part of the coast.

Half a second of held speed at the start of a coast looks like zero resistance at the highest speed. A held speed
wanders, so neither its maximum nor its noise marks the release T. The speed around it is fitted piecewise::

    V(t) = V0 + p t                                t <= T
    V(t) = V0 + p t - c (t - T) + q (t - T)^2      t >  T
"""

from __future__ import annotations

import numpy as np

from vdyn_cli.inference.bins import cut
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

BIN = 0.1  # s: a tenth of ``held_release``
# Bins before and after the release that is tried first and last; it must lie between these. A receiver of 1 Hz then
# shows a release after 3 s of held speed: three samples for the two unknowns before it, five for those after it.
FEWEST_HELD, FEWEST_FALLING = 2, 5


def released(log: Log, smooth: Array, top: int, end: int) -> int:
    """First index of the coast: one second after the release, or ``top`` where the log begins with the coast.

    The release T minimizes the residual of the module's two pieces near the highest speed.

    Parameters
    ----------
    log : with speed, m/s.
    smooth : (n,) m/s, the speed without noise. top, end : index of its highest value and of the end of its fall.
    """
    drop = min(COASTDOWN_POLICY.held_drop, float(smooth[top] - smooth[end]) / 3.0)
    if drop <= 0.0 or smooth[top] < smooth[: top + 1].max():  # the car already coasts where it passes an upper limit
        return top
    falls, beyond = (int(np.flatnonzero(smooth[top : end + 1] <= smooth[top] - n * drop)[0]) for n in (1.0, 2.0))
    for first in (_held_from(smooth, top, drop), top):  # after a long hold, else after an acceleration
        window = slice(first, top + beyond + 1)
        bins = cut(log.time[window], BIN)
        found = _breakpoint(bins.time, bins.mean(log["speed"][window]), float(log.time[top + falls]))
        if found is not None:
            break
    if found is None and log.time[top] - log.time[0] < COASTDOWN_POLICY.held_release:
        return top
    release = max(float(log.time[top]), found or -np.inf)
    return min(int(np.searchsorted(log.time, release + COASTDOWN_POLICY.held_release)), end)


def held_before(time: Array, smooth: Array, top: int, start: int) -> tuple[float, float] | None:
    """Begin and end, s, of the speed that was held before a coast; None where it was not, or too shortly.

    Parameters
    ----------
    time, smooth : (n,) s and m/s. top, start : index of the highest speed, and that at which the coast begins.
    """
    begin, end = float(time[_held_from(smooth, top, COASTDOWN_POLICY.held_drop)]), float(time[start])
    return (begin, end) if start > top and end - begin >= COASTDOWN_POLICY.held_shortest else None


def _held_from(smooth: Array, top: int, drop: float) -> int:
    """First index from which on the speed stays within ``held_share`` of a drop (m/s) from that at ``top``."""
    apart = np.flatnonzero(np.abs(smooth[:top] - smooth[top]) > COASTDOWN_POLICY.held_share * drop)
    return int(apart[-1]) + 1 if apart.size else 0


def _breakpoint(time: Array, speed: Array, latest: float) -> float | None:
    """Time of the release, s; None where the speed does not change from steady to falling.

    Parameters
    ----------
    time, speed : (n,) s and m/s. latest : s, last release that is tried.
    """
    best, fit = np.inf, None
    tried = [k for k in range(FEWEST_HELD, time.size - FEWEST_FALLING) if time[k] <= latest]
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
    return at if falling > 0.0 and abs(steady) < COASTDOWN_POLICY.held_slope * falling else None
