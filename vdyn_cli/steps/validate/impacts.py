"""Impacts of a half-shaft's flanks: when they meet is known to a millisecond, and a sample beside that instant is not.

A shaft with play that carries no torque takes up a hundred newton meters within a sample of 10 ms. A simulation that is
right to a millisecond has one of these samples on the other side of the impact, by which it misses sixty times the
sensor's noise. Both samples of such a rise are left out of the comparison. Those before and after tell the instant.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array

IDLE = 5.0  # noise levels within which a half-shaft carries no torque
LOADED = 20.0  # noise levels that it carries one sample after an impact


def impact_samples(torque: Array, level: float) -> NDArray[np.bool_]:
    """Both samples of each rise from a torque that rested at zero.

    Parameters
    ----------
    torque : (n,) N m of a half-shaft, NaN where nothing was written. level : N m, noise of a sample.

    Returns
    -------
    (n,) mask.

    Notes
    -----
    Two samples of no torque and a third of a large one: an oscillation without play is steepest where it passes zero,
    and does not rest there.
    """
    size = np.abs(torque)
    idle, loaded = size < IDLE * level, size > LOADED * level
    rises = np.flatnonzero(idle[:-2] & idle[1:-1] & loaded[2:])
    found = np.zeros(torque.size, dtype=bool)
    found[rises + 1] = found[rises + 2] = True
    return found
