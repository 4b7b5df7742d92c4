"""The speed at the first and the last sample of a segment."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array

START = 1.0  # s over which start and end speeds are fitted
FEWEST_PARABOLA = 8  # samples for a parabola


def end_speed(time: Array, speed: Array, first: bool) -> tuple[float, float]:
    """Speed at the first or last sample by a parabola fitted over one second, and its standard error, m/s.

    The standard error includes half of the difference from a straight line, for stronger curvature, as in a log that
    begins with a tip-in. A straight line alone is used for few samples only: with a jerk of 0.3 m/s^3 it is off by
    25 mm/s, an error that all accelerating starts share and that would look like a delay.

    Parameters
    ----------
    time, speed : (n,) s and m/s, the speed may contain NaN. first : whether at the first sample, else at the last.
    """
    good = np.isfinite(speed)
    t, v = time[good], speed[good]
    edge = time[0] if first else time[-1]
    near = np.abs(t - edge) <= START
    if near.sum() < 5:
        near = np.argsort(np.abs(t - edge))[:5]
    x, y = t[near] - edge, v[near]
    line, std = _at_zero(x, y, 1)
    if x.size < FEWEST_PARABOLA:
        return line, std
    parabola, wider = _at_zero(x, y, 2)
    return parabola, float(np.hypot(wider, (parabola - line) / 2))


def _at_zero(x: Array, y: Array, order: int) -> tuple[float, float]:
    """A polynomial's value at zero, and its standard error."""
    fitted, unit = np.polyfit(x, y, order, cov="unscaled")
    left = y - np.polyval(fitted, x)
    variance = float(left @ left) / max(x.size - order - 1, 1) * float(unit[-1, -1])
    return float(fitted[-1]), float(np.sqrt(variance))
