"""Confidence intervals from the scatter between independent units (runs or blocks), not from the number of samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array

ALONE = 1e-9  # share of a direction's information from other units that counts as zero: rounding of the eigenvalues


@dataclass(frozen=True)
class UnitFactor:
    """QR factor of one independent unit's rows at the minimum.

    Parameters
    ----------
    run : index of the run; units of one run share its own unknowns.
    factor : (h, m + s + 1), its rows or QR factor over [own | shared | residual].
    own : (m, m), covariance of the run's own unknowns for known shared ones.
    own_response : (m, s), derivative of the own unknowns' optimum with respect to the shared ones.
    """

    run: int
    factor: Array
    own: Array
    own_response: Array


@dataclass(frozen=True)
class Spread:
    """Scatter of the estimate between units.

    Parameters
    ----------
    deletions : (units, s), change of the shared unknowns, to first order, when each unit is left out.
    covariance : (s, s), of the shared unknowns.
    degrees : (s,), degrees of freedom of Student's t (Satterthwaite).
    effective : (s,), effective number of units.
    """

    deletions: Array
    covariance: Array
    degrees: Array
    effective: Array


def spread(units: Sequence[UnitFactor], covariance: Array) -> Spread:
    """Cluster-robust covariance of the shared unknowns from the residuals of whole units.

    With J the unit's total derivative with respect to the shared unknowns, r its residual, C the inverse information
    of all units and priors, and H = J C J' + (the same for the own unknowns) the unit's leverage::

        score contribution  d = C J' (1 - H)^(-1/2) r        cov = sum d d', unbiased where the noise model holds
        deletion                C J' (1 - H)^(-1) r          (jackknife; cov too large where units share unknowns)

    Degrees of freedom after Satterthwaite: 2 mean^2 / variance of cov under the noise model.

    Parameters
    ----------
    covariance : (s, s), inverse information about the shared unknowns from all units and priors.

    Assumes that units are independent; within a unit the noise may have any correlation.
    Source: Bell and McCaffrey, Survey Methodology 28 (2002) 169-181, there called bias-reduced linearization.
    """
    contributions, deletions, influences, information = [], [], [], []
    for unit in units:
        m = len(unit.own)
        own = unit.factor[:, :m]
        total = unit.factor[:, m:-1] + own @ unit.own_response
        leverage, axes = np.linalg.eigh(total @ covariance @ total.T + own @ unit.own @ own.T)
        # Where only this unit determines a direction, the fit makes its residual zero there.
        left = np.where(1.0 - leverage > ALONE, 1.0 - leverage, np.inf)
        gain, residual = covariance @ total.T @ axes, axes.T @ unit.factor[:, -1]
        weights = gain / np.sqrt(left) @ axes.T
        contributions.append(weights @ unit.factor[:, -1])
        deletions.append(gain @ (residual / left))
        influences.append(_Influence(weights, weights @ total, weights @ own))
        information.append(np.sum((total @ covariance) ** 2, axis=0))
    moved = np.array(contributions)
    degrees = np.array([_degrees(units, influences, covariance, i) for i in range(len(covariance))])
    return Spread(np.array(deletions), moved.T @ moved, degrees, effective_number(np.array(information)))


def effective_number(shares: Array) -> Array:
    """Effective number of units with these shares of information, (units, s): (sum I)^2 / sum I^2 (Kish).

    Parameters
    ----------
    shares : (units, s) information of each unit about each of s unknowns.

    Returns
    -------
    (s,), 1 to units. Source: Kish, Survey Sampling, Wiley 1965.
    """
    return np.asarray(np.sum(shares, axis=0) ** 2 / np.maximum(np.sum(shares**2, axis=0), 1e-300))


class _Influence(NamedTuple):
    """Derivatives of a unit's score contribution by its rows (s, h), the shared (s, s) and its own unknowns (s, m)."""

    rows: Array
    shared: Array
    own: Array


def _degrees(units: Sequence[UnitFactor], influences: Sequence[_Influence], covariance: Array, i: int) -> float:
    """Satterthwaite's degrees of freedom for shared unknown ``i`` under the noise model."""
    shared = np.array([one.shared[i] for one in influences])
    matrix = np.diag([float(one.rows[i] @ one.rows[i]) for one in influences]) - shared @ covariance @ shared.T
    run = np.array([u.run for u in units if u.own.size])  # empty where runs are the units: no own unknowns remain
    for k in np.unique(run):
        at = np.flatnonzero(run == k)
        own = np.array([influences[int(j)].own[i] for j in at])
        matrix[np.ix_(at, at)] -= own @ units[at[0]].own @ own.T
    return float(np.trace(matrix) ** 2 / max(np.sum(matrix**2), 1e-300))


def equal_information_blocks(information: Array, blocks: int) -> NDArray[np.int64]:
    """Divide consecutive rows into blocks that carry equal information.

    Parameters
    ----------
    information : (n,), of each row, >= 0.
    blocks : number of blocks; fewer where single rows carry more than a block's share.

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
    """Quantile of Student's t at a probability (0.975: of a 95 % interval); ``degrees`` may be infinite (normal)."""
    from scipy.special import stdtrit

    return float(stdtrit(min(degrees, 1e9), probability))
