"""Intervals that mean what they say: from independent units of evidence, never from the number of samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.fit.triangles import Array

ALONE = 1e-9  # of a residual left by leaving one unit out: nothing else tells about that direction


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
    changes : (units, s), each unit's pull on the shared unknowns.
    covariance : (s, s), of the shared unknowns.
    degrees : (s,), of Student's t, from how evenly the units pull.
    effective : (s,), how many equal units would tell as much.
    """

    changes: Array
    covariance: Array
    degrees: Array
    effective: Array


def spread(units: Sequence[Evidence], covariance: Array, power: float = 0.5) -> Spread:
    """Covariance of the shared unknowns from the residuals of whole units.

    With J the unit's total derivative to the shared unknowns, r its residual, C the covariance from the information
    of everything, and H = J C J' + (own unknowns alike) the unit's leverage, the unit pulls by::

        d = C J' (1 - H)^(-power) r,    cov = sum d d'

    power 1 leaves the unit out (the jackknife); power 1/2 makes cov unbiased where the noise model holds. Degrees of
    freedom after Satterthwaite: twice the squared mean over the variance of cov under that noise model.

    Parameters
    ----------
    covariance : (s, s), inverse information about the shared unknowns, priors and all units considered.

    Source: Bell and McCaffrey, Survey Methodology 28 (2002) 169-181, there called bias-reduced linearisation.
    """
    pulls, ways, told = [], [], []
    for unit in units:
        m = len(unit.own)
        own = unit.triangle[:, :m]
        total = unit.triangle[:, m:-1] + own @ unit.follow
        leverage, axes = np.linalg.eigh(total @ covariance @ total.T + own @ unit.own @ own.T)
        left = 1.0 - leverage
        root = axes * np.where(left > ALONE, np.where(left > ALONE, left, 1.0) ** -power, 0.0) @ axes.T
        way = covariance @ total.T @ root
        pulls.append(way @ unit.triangle[:, -1])
        ways.append((way, way @ total, way @ own))
        told.append(np.sum((total @ covariance) ** 2, axis=0))
    changes, shares = np.array(pulls), np.array(told)
    degrees = np.array([_degrees(units, ways, covariance, i) for i in range(len(covariance))])
    effective = np.sum(shares, axis=0) ** 2 / np.maximum(np.sum(shares**2, axis=0), 1e-300)
    return Spread(changes, changes.T @ changes, degrees, effective)


def _degrees(units: Sequence[Evidence], ways: list[tuple[Array, Array, Array]], covariance: Array, i: int) -> float:
    """Satterthwaite's degrees of freedom for one shared unknown, were the residuals as the noise model has them."""
    through = np.array([w[1][i] for w in ways])
    matrix = np.diag([float(w[0][i] @ w[0][i]) for w in ways]) - through @ covariance @ through.T
    run = np.array([u.run for u in units])
    for k in np.unique(run):
        at = np.flatnonzero(run == k)
        own = np.array([ways[j][2][i] for j in at])
        matrix[np.ix_(at, at)] -= own @ units[at[0]].own @ own.T
    return float(np.trace(matrix) ** 2 / np.sum(matrix**2))


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
    """Student's quantile."""
    from scipy.special import stdtrit

    return float(stdtrit(degrees, probability))
