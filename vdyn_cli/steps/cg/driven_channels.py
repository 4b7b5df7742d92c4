"""What of loads and pitch the driver causes: where the rear load is not logged, the road's part is left out of it.

A body that follows an uneven road heaves as it pitches, z'' = V th' on long waves. Without rear loads that heave is an
error of the balance which is correlated with the measured pitch and load, so that these bias the unknowns. What follows
from the acceleration is not correlated with the road: an instrumental variable (two-stage least squares).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.physics.models.load_transfer import HEAVES
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.cg.load_windows import LoadWindows

# s, of the accelerations that loads and pitch follow: a body has swung out after two swings at 1.3 Hz, and other
# clocks may be late by 0.2 s. Spaced so that a response of 3 Hz is followed.
EARLIEST, LATEST, SPACING = -0.3, 1.5, 0.08
DRIVEN = ("front_load", "acceleration", "pitch", "pitch_rate", *HEAVES)


def driven_channels(runs: Sequence[LoadWindows], lever: float) -> tuple[Mapping[str, Array], ...]:
    """Of each run, channels (n,) as they follow from accelerations before and after, drag and rolling.

    x(t) = c + sum_j b_j a(t - t_j) + k V^2 + r (wheels roll), fitted to the other runs

    (to the run itself where it is the only one): what the fit takes of a run's own road would be correlated with it.

    Parameters
    ----------
    lever : m, of the antenna above the center of gravity, whose acceleration the road's pitching does not change.
    """
    basis = [_causes(run, lever) for run in runs]
    squares = [one.T @ one for one in basis]
    products = [b.T @ np.column_stack([run.channels[n] for n in DRIVEN]) for b, run in zip(basis, runs, strict=True)]
    found = []
    for k, one in enumerate(basis):
        others = [j for j in range(len(runs)) if j != k] or [k]
        response = np.linalg.lstsq(sum(squares[j] for j in others), sum(products[j] for j in others), rcond=None)[0]
        found.append(dict(zip(DRIVEN, (one @ response).T, strict=True)))
    return tuple(found)


def _causes(run: LoadWindows, lever: float) -> Array:
    """What a run's channels follow, (n, causes)."""
    from scipy.ndimage import gaussian_filter1d

    width = SPACING / 2 / run.step
    push, rate = (gaussian_filter1d(run.channels[n], width, mode="nearest") for n in ("acceleration", "pitch_rate"))
    push = push + lever * np.gradient(rate, run.time)
    late = [np.interp(run.time - lag, run.time, push) for lag in np.arange(EARLIEST, LATEST, SPACING)]
    return np.column_stack([np.ones(run.time.size), run.channels["speed"] ** 2, run.channels["rolling"], *late])
