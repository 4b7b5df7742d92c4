"""The parts of loads and pitch that the driver causes, as instruments on an uneven road.

A body that follows an uneven road heaves as it pitches, z'' = V th' on long waves. Without rear loads that heave is an
error of the balance that is correlated with the measured pitch and load, and biases the unknowns. So is the force of
the axles that follow the road. The parts that follow from the acceleration are not correlated with the road:
instrumental variables (two-stage least squares).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.physics.models.load_transfer import HEAVES
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.cg.load_windows import LoadWindows

# s, range and step of the lags of the acceleration: the response of a body has decayed after two periods at 1.3 Hz, and
# clocks may differ by 0.2 s. The step resolves a response of 3 Hz.
EARLIEST, LATEST, SPACING = -0.3, 1.5, 0.08
DRIVEN = ("front_load", "rear_load", "acceleration", "pitch", "pitch_rate", *HEAVES)


def driven_channels(runs: Sequence[LoadWindows], lever: float) -> tuple[Mapping[str, Array], ...]:
    """For each run, channels (n,) predicted from lagged accelerations, drag and standstill.

    x(t) = c + sum_j b_j a(t - t_j) + k V^2 + r (wheels at rest), fitted to the other runs

    A single run is fitted to itself. The run is left out because the fit would absorb part of its own road.

    Parameters
    ----------
    lever : m, height of the antenna above the center of gravity; the road's pitching does not change the acceleration
        of the latter.
    """
    basis = [_regressors(run, lever) for run in runs]
    squares = [one.T @ one for one in basis]
    names = [n for n in DRIVEN if n in runs[0].channels]
    products = [b.T @ np.column_stack([run.channels[n] for n in names]) for b, run in zip(basis, runs, strict=True)]
    found = []
    for k, one in enumerate(basis):
        others = [j for j in range(len(runs)) if j != k] or [k]
        response = np.linalg.lstsq(sum(squares[j] for j in others), sum(products[j] for j in others), rcond=None)[0]
        found.append(dict(zip(names, (one @ response).T, strict=True)))
    return tuple(found)


def without_driven(runs: Sequence[LoadWindows], imbalances: Sequence[Array], lever: float) -> tuple[Array, ...]:
    """Each run's mean imbalances of its windows (k,) without the part that follows from lagged accelerations.

    A model error, such as a clock offset, follows from what the driver does. The road does not.

    Parameters
    ----------
    lever : m, height of the antenna above the center of gravity.
    """
    basis = [run.integral(_regressors(run, lever)) / run.width[:, None] for run in runs]
    response = np.linalg.lstsq(np.vstack(basis), np.concatenate(imbalances), rcond=None)[0]
    return tuple(e - b @ response for e, b in zip(imbalances, basis, strict=True))


def _regressors(run: LoadWindows, lever: float) -> Array:
    """Regressors (n, r) of a run's channels."""
    from scipy.ndimage import gaussian_filter1d

    width = SPACING / 2 / run.step
    push, rate = (gaussian_filter1d(run.channels[n], width, mode="nearest") for n in ("acceleration", "pitch_rate"))
    push = push + lever * np.gradient(rate, run.time)
    late = [np.interp(run.time - lag, run.time, push) for lag in np.arange(EARLIEST, LATEST, SPACING)]
    return np.column_stack([np.ones(run.time.size), run.channels["speed"] ** 2, 1 - run.channels["rolling"], *late])
