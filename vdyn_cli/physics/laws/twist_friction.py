"""Dry friction of a shaft that is twisted to and fro, from its logged twist."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from vdyn_cli.quantities.arrays import Array

SLIP = 1e-3  # rad of twist, within which dry friction changes its sign
MOST_NOISE = 6.0  # standard deviations of the twist's noise: its peak to peak within a second
SEEN = 0.1  # of SLIP, the noise from peak to peak at most: with 0.3, 20 N m of friction were found as 17
NEEDED = f"a twist whose noise is below {1e6 * SEEN * SLIP / MOST_NOISE:.0f} microrad, so that its reversals show"


def shows_reversals(noise: float) -> bool:
    """Whether a twist with this standard deviation, rad, of its noise shows at which twist it reverses."""
    return MOST_NOISE * noise <= SEEN * SLIP


def turned_twist(twist: Array, noise: float) -> Array:
    """Sense of friction, the direction of the last change of the twist, (n,) from -1 to 1; 0 where noise hides it.

    z = s - (s - z0) exp(-|phi - phi0| / SLIP), s the sign of the change, z0 and phi0 at the last reversal by
    ``MOST_NOISE`` standard deviations or more. phi is the extreme since then: noise turns nothing.

    Parameters
    ----------
    twist : (n,) rad. noise : its standard deviation, rad.

    Source: Dahl, A Solid Friction Model, The Aerospace Corporation, TOR-0158(3107-18)-1, 1968.
    """
    found, start = np.zeros(twist.size), 0.0
    if not shows_reversals(noise):
        return found
    for first, last in pairwise(_reversals(twist, MOST_NOISE * noise)):
        leg = twist[first : last + 1] - twist[first]
        sign = float(np.sign(leg[-1]))
        found[first : last + 1] = sign - (sign - start) * np.exp(-np.maximum.accumulate(sign * leg) / SLIP)
        start = float(found[last])
    return found


def _reversals(values: Array, least: float) -> list[int]:
    """Indices of the first and last value and of the extremes between them, each ``least`` from the next extreme."""
    found, low, high, sign = [0], 0, 0, 0
    for i, value in enumerate(values.tolist()):
        low, high = (i if value < values[low] else low), (i if value > values[high] else high)
        if sign >= 0 and values[high] - value > least:
            found, sign, low = [*found, high], -1, i
        elif sign <= 0 and value - values[low] > least:
            found, sign, high = [*found, low], 1, i
    return [*found, values.size - 1]
