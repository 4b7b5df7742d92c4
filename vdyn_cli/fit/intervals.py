"""Intervals that mean what they say: from independent units of evidence, never from the number of samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.fit.triangles import Array


@dataclass(frozen=True)
class Evidence:
    """What one unit says about the unknowns it touches.

    Parameters
    ----------
    triangle : (h, k + 1), its rows or triangle over [its unknowns | residual] at the minimum.
    covariance : (k, k), inverse information of all units (and priors) about those unknowns.
    shared : the last how many of them are the shared ones.
    """

    triangle: Array
    covariance: Array
    shared: int


def equal_information_blocks(information: Array, blocks: int) -> NDArray[np.int64]:
    """Cut rows, in their order, into blocks that carry equal information.

    Parameters
    ----------
    information : (n,), what each row tells, >= 0.
    blocks : how many; fewer come out where single rows carry more than a block's share.

    Returns
    -------
    (n,) labels 0, 1, 2 ... without gaps.
    """
    total = float(np.sum(information))
    even = np.full(len(information), 1.0 / max(len(information), 1))
    share = np.asarray(information, dtype=float) / total if total > 0 else even
    middle = np.cumsum(share) - share / 2
    labels = np.minimum((middle * blocks).astype(np.int64), blocks - 1)
    return np.unique(labels, return_inverse=True)[1].astype(np.int64)


def deletions(units: Sequence[Evidence]) -> Array:
    """The change of the shared unknowns when each unit is left out, to first order, (units, s).

    With the unit's Jacobian J and residual r, and C the inverse information of everything::

        C J' (1 - J C J')^-1 r
    """
    return np.array([_deletion(u) for u in units])


def _deletion(unit: Evidence) -> Array:
    jacobian, residual = unit.triangle[:, :-1], unit.triangle[:, -1]
    gain = unit.covariance @ jacobian.T
    leverage, axes = np.linalg.eigh(jacobian @ gain)
    left = 1.0 - leverage
    # Where the unit alone determines a direction, leaving it out would leave nothing: that direction is not moved.
    inverse = np.where(left > 1e-9, 1.0 / np.where(left > 1e-9, left, 1.0), 0.0)
    return np.asarray((gain @ (axes * inverse) @ (axes.T @ residual))[len(gain) - unit.shared :])


def jackknife_covariance(changes: Array) -> Array:
    """Covariance of the estimate from its changes, (units, s), when each of B units is left out.

    cov = (B - 1)/B sum_b (d_b - mean d)(d_b - mean d)'
    """
    count = len(changes)
    centred = changes - changes.mean(axis=0)
    return np.asarray((count - 1) / count * centred.T @ centred)


def effective_number(shares: Array) -> float:
    """How many equal units would be worth as much: (sum I)^2 / sum I^2."""
    return float(np.sum(shares) ** 2 / np.sum(shares**2)) if np.any(shares > 0) else 0.0


def t_quantile(degrees: float, probability: float = 0.975) -> float:
    """Student's quantile."""
    from scipy.special import stdtrit

    return float(stdtrit(degrees, probability))
