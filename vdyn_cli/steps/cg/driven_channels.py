"""The parts of loads and pitch that the driver causes, as instruments.

On an uneven road these parts replace the true channels in the balance's derivatives. A body that follows the road
heaves as it pitches, z'' = V th' on long waves. Without rear loads that heave is an error of the balance that is
correlated with the measured pitch and load, and biases the unknowns. So is the force of the axles that follow the road.
The parts that follow from the acceleration are not correlated with the road: instrumental variables (two-stage least
squares). They follow from the *true* acceleration, as estimated: the noise of the measured one is in the balance, too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from vdyn_cli.physics.models.load_transfer import HEAVES
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.cg.load_windows import SMOOTHED, LoadWindows
from vdyn_cli.steps.cg.noise import SMOOTHING

NO_RESPONSES: Mapping[str, Array] = MappingProxyType({})
DRIVEN = ("front_load", "rear_load", "acceleration", "pitch", "pitch_rate", *HEAVES)


def driven_responses(runs: Sequence[LoadWindows], lever: float) -> tuple[Mapping[str, Array], ...]:
    """For each run and channel, coefficients (r,) of lagged accelerations, drag and standstill.

    x(t) = c + sum_j b_j a(t - t_j) + k V^2 + r (wheels at rest), fitted to the other runs

    A single run is fitted to itself. The run is left out because the fit would absorb part of its own road.

    Parameters
    ----------
    lever : m, height of the antenna above the center of gravity; the road's pitching does not change the acceleration
        of the latter.
    """
    basis = [run.driven(lever) for run in runs]
    squares = [one.T @ one for one in basis]
    names = [n for n in DRIVEN if n in runs[0].channels]
    products = [b.T @ np.column_stack([run.channels[n] for n in names]) for b, run in zip(basis, runs, strict=True)]
    found = []
    for k in range(len(runs)):
        others = [j for j in range(len(runs)) if j != k] or [k]
        response = np.linalg.lstsq(sum(squares[j] for j in others), sum(products[j] for j in others), rcond=None)[0]
        found.append(dict(zip(names, response.T, strict=True)))
    return tuple(found)


def driven_channels(
    run: LoadWindows, true: Mapping[str, Array], lever: float, responses: Mapping[str, Array]
) -> dict[str, Array]:
    """Channels (n,) of a run as they follow from its true acceleration and pitch rate.

    Parameters
    ----------
    true : channels (n,) smoothed by ``SMOOTHING``. lever, responses : as in ``driven_responses``.
    """
    at_antenna, per_lever = run.lagged(true, (SMOOTHED**2 - SMOOTHING**2) ** 0.5)
    basis = at_antenna + lever * per_lever
    return {n: basis @ response for n, response in responses.items()}


def without_driven(runs: Sequence[LoadWindows], imbalances: Sequence[Array], lever: float) -> tuple[Array, ...]:
    """Each run's mean imbalances of its windows (k,) without the part that follows from lagged accelerations.

    A model error, such as a clock offset, follows from what the driver does. The road does not.

    Parameters
    ----------
    lever : m, height of the antenna above the center of gravity.
    """
    basis = [run.driven_means(lever) for run in runs]
    response = np.linalg.lstsq(np.vstack(basis), np.concatenate(imbalances), rcond=None)[0]
    return tuple(e - b @ response for e, b in zip(imbalances, basis, strict=True))
