"""Finds the samples at impacts of the flanks of a half-shaft with play, which are left out of the comparison.

When the play is taken up, the torque rises by a hundred newton meters within a sample of 10 ms. A simulation with an
error of one millisecond has one of these samples on the other side of the impact and misses it by sixty times the
sensor's noise. Both samples of such a rise are left out; those before and after determine the instant.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array

IDLE = 5.0  # noise levels within which a half-shaft carries no torque
LOADED = 20.0  # noise levels that its torque exceeds one sample after an impact


def impact_samples(torque: Array, level: float) -> NDArray[np.bool_]:
    """Both samples of each steep rise from a torque at rest at zero.

    Parameters
    ----------
    torque : (n,) N m of a half-shaft, NaN where it is missing. level : N m, noise of a sample.

    Returns
    -------
    (n,) mask.

    Notes
    -----
    An impact is two samples without torque and a third with a large one. An oscillation without play is steepest at
    zero and does not rest there.
    """
    size = np.abs(torque)
    idle, loaded = size < IDLE * level, size > LOADED * level
    rises = np.flatnonzero(idle[:-2] & idle[1:-1] & loaded[2:])
    found = np.zeros(torque.size, dtype=bool)
    found[rises + 1] = found[rises + 2] = True
    return found
