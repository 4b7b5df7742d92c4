"""Intervals that mean what they say: from independent units of evidence, never from the number of samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.qr_factors import Array

ALONE = 1e-9  # of a direction's information that other units give: as good as none


@dataclass(frozen=True)
class Evidence:
    """What one unit says about the shared unknowns and its run's own, at the minimum.

    Parameters
    ----------
    run : units of one run share its own unknowns.
    triangle : (h, m + s + 1), its rows or triangle over [own | shared | residual].
    own : (m, m), covariance of the run's own unknowns were the shared ones known.
    follow : (m, s), how the own unknowns follow the shared ones.
    """

    run: int
    triangle: Array
    own: Array
    follow: Array


@dataclass(frozen=True)
class Spread:
    """How the estimate varies from unit to unit.

    Parameters
    ----------
    deletions : (units, s), change of the shared unknowns, to first order, when each unit is left out.
    covariance : (s, s), of the shared unknowns.
    degrees : (s,), of Student's t, from how evenly the units tell.
    effective : (s,), how many equal units would tell as much.
    """

    deletions: Array
    covariance: Array
    degrees: Array
    effective: Array


def spread(units: Sequence[Evidence], covariance: Array) -> Spread:
    """Covariance of the shared unknowns from the residuals of whole units.

    With J the unit's total derivative to the shared unknowns, r its residual, C the covariance from the information
    of everything, and H = J C J' + (own unknowns alike) the unit's leverage::

        pull      d = C J' (1 - H)^(-1/2) r        cov = sum d d', unbiased where the noise model holds
        deletion      C J' (1 - H)^(-1) r          the jackknife's, whose cov is too large where units share unknowns

    Degrees of freedom after Satterthwaite: 2 mean^2 / variance of cov under the noise model.

    Parameters
    ----------
    covariance : (s, s), inverse information about the shared unknowns, priors and all units considered.

    Assumes that units err independently; within a unit the noise may be anything.
    Source: Bell and McCaffrey, Survey Methodology 28 (2002) 169-181, there called bias-reduced linearization.
    """
    pulls, deletions, ways, told = [], [], [], []
    for unit in units:
        m = len(unit.own)
        own = unit.triangle[:, :m]
        total = unit.triangle[:, m:-1] + own @ unit.follow
        leverage, axes = np.linalg.eigh(total @ covariance @ total.T + own @ unit.own @ own.T)
        # Where nothing but this unit tells about a direction, its residual there is zero by the fit.
        left = np.where(1.0 - leverage > ALONE, 1.0 - leverage, np.inf)
        gain, residual = covariance @ total.T @ axes, axes.T @ unit.triangle[:, -1]
        way = gain / np.sqrt(left) @ axes.T
        pulls.append(way @ unit.triangle[:, -1])
        deletions.append(gain @ (residual / left))
        ways.append((way, way @ total, way @ own))
        told.append(np.sum((total @ covariance) ** 2, axis=0))
    moved = np.array(pulls)
    degrees = np.array([_degrees(units, ways, covariance, i) for i in range(len(covariance))])
    return Spread(np.array(deletions), moved.T @ moved, degrees, effective_number(np.array(told)))


def effective_number(shares: Array) -> Array:
    """How many equal units would tell as much as units with these shares, (units, s): (sum I)^2 / sum I^2."""
    return np.asarray(np.sum(shares, axis=0) ** 2 / np.maximum(np.sum(shares**2, axis=0), 1e-300))


def _degrees(units: Sequence[Evidence], ways: list[tuple[Array, Array, Array]], covariance: Array, i: int) -> float:
    """Satterthwaite's degrees of freedom for one shared unknown, were the residuals as the noise model has them."""
    through = np.array([w[1][i] for w in ways])
    matrix = np.diag([float(w[0][i] @ w[0][i]) for w in ways]) - through @ covariance @ through.T
    run = np.array([u.run for u in units])
    for k in np.unique(run):
        at = np.flatnonzero(run == k)
        own = np.array([ways[j][2][i] for j in at])
        matrix[np.ix_(at, at)] -= own @ units[at[0]].own @ own.T
    return float(np.trace(matrix) ** 2 / max(np.sum(matrix**2), 1e-300))


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


def t_quantile(degrees: float, probability: float = 0.975) -> float:
    """Student's quantile; a normal variable's where the degrees of freedom are many or infinite."""
    from scipy.special import stdtrit

    return float(stdtrit(min(degrees, 1e9), probability))
