"""QR factors of a regression over runs, and the bordered normal system in which each run's own unknowns are eliminated.

A run's whitened rows are kept as the QR factor of [own | shared | residual]: the memory of a fit does not grow with the
length of the logs, and its time grows linearly with the number of runs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import svd

from vdyn_cli.quantities.arrays import Array

DEPENDENT = 1e-7  # of the largest singular value of unit columns: rounding of a QR factor of 1e5 rows is below 1e-10
WEAK = 1e-9  # of a column's norm: weight of a row that pulls the step of an own unknown to zero


def qr_factor(matrix: Array) -> Array:
    """The upper triangular QR factor R with R'R = M'M.

    Parameters
    ----------
    matrix : (n, k + 1), rows of [jacobian | residual].

    Returns
    -------
    (k + 1, k + 1), upper triangular; zero rows below where n is smaller than k + 1.
    """
    width = matrix.shape[1]
    if matrix.shape[0] == 0:
        return np.zeros((width, width))
    factor: Array = np.asarray(np.linalg.qr(matrix, mode="r"))
    missing = width - factor.shape[0]
    return np.vstack([factor, np.zeros((missing, width))]) if missing else factor


def least_squares(columns: Array, y: Array, rounding: float) -> Array:
    """Least-squares coefficients (p,) or (p, k) of y (n,) or (n, k) on columns (n, p) of any scale.

    Parameters
    ----------
    rounding : of the largest singular value of the unit columns, below which a direction is left out.
    """
    size = np.sqrt(np.sum(columns**2, axis=0))
    size = np.where(size > 0, size, 1.0)
    return np.asarray((np.linalg.lstsq(columns / size, y, rcond=rounding)[0].T / size).T)


def orthonormal(columns: Array) -> Array:
    """Orthonormal basis of the span of columns of any scale, without dependent directions.

    Left singular vectors of the columns scaled to length one, with singular values above ``DEPENDENT`` of the largest.

    Parameters
    ----------
    columns : (n, k).

    Returns
    -------
    (n, r) with r the rank; (n, 0) where all columns are zero.
    """
    size = np.sqrt(np.sum(columns**2, axis=0))
    scaled = columns[:, size > 0] / size[size > 0]
    if not scaled.shape[1]:
        return np.zeros((len(columns), 0))
    try:
        u, s, _ = np.linalg.svd(scaled, full_matrices=False)
    except np.linalg.LinAlgError:  # divide and conquer may fail for dependent columns; the QR iteration does not
        u, s, _ = svd(scaled, full_matrices=False, lapack_driver="gesvd")
    return np.asarray(u[:, s > DEPENDENT * s[0]])


@dataclass(frozen=True)
class BorderedSystem:
    """The bordered (block-arrow) normal system of all runs at one point of the unknowns.

    Parameters
    ----------
    runs : (g, h, m + s + 1), each run's rows or QR factor over [own | shared | residual], its own priors included.
    common : (p, s + 1), rows of the priors of shared unknowns.
    n_own : m, number of unknowns of each run.
    """

    runs: Array
    common: Array
    n_own: int

    @property
    def n_shared(self) -> int:
        """s, number of shared unknowns."""
        return int(self.runs.shape[2]) - 1 - self.n_own

    def column_norms(self) -> Array:
        """Norms of the Jacobian's columns, (s + g m): shared first, then run by run."""
        squares = np.einsum("ghk,ghk->gk", self.runs, self.runs)
        m, s = self.n_own, self.n_shared
        shared = squares[:, m : m + s].sum(axis=0) + np.einsum("pk,pk->k", self.common[:, :s], self.common[:, :s])
        return np.asarray(np.sqrt(np.concatenate([shared, squares[:, :m].ravel()])))

    def after(self, step: Array, held: NDArray[np.bool_]) -> BorderedSystem:
        """The system after a step (s + g m) of the held unknowns; their columns become zero."""
        if not held.any():
            return self
        s, m = self.n_shared, self.n_own
        done = np.where(held, step, 0.0)
        runs, common = self.runs.copy(), self.common.copy()
        runs[:, :, -1] += self.runs[:, :, m:-1] @ done[:s]
        runs[:, :, -1] += np.einsum("ghk,gk->gh", self.runs[:, :, :m], done[s:].reshape(len(runs), m))
        common[:, -1] += common[:, :s] @ done[:s]
        runs[:, :, m:-1] *= ~held[:s]
        runs[:, :, :m] *= ~held[s:].reshape(len(runs), 1, m)
        common[:, :s] *= ~held[:s]
        return BorderedSystem(runs, common, m)

    def reduced(self) -> Reduced:
        """The system of the shared unknowns; own unknowns that no row determines keep their values."""
        norms = self.column_norms()
        weak = np.where(norms > 0, WEAK * norms, 1.0)
        weak[: self.n_shared] = 0.0
        return reduce(self, weak)

    def gradient(self) -> Array:
        """J'r, (s + g m): shared first, then run by run."""
        products = np.einsum("ghk,gh->gk", self.runs[:, :, :-1], self.runs[:, :, -1])
        m = self.n_own
        shared = products[:, m:].sum(axis=0) + self.common[:, :-1].T @ self.common[:, -1]
        return np.concatenate([shared, products[:, :m].ravel()])

    def reduction(self, step: Array) -> float:
        """Reduction of half the sum of squares of the linearized problem by a step, (s + g m)."""
        s, m = self.n_shared, self.n_own
        own = step[s:].reshape(len(self.runs), m)
        runs = np.einsum("ghk,gk->gh", self.runs[:, :, :m], own) + self.runs[:, :, m : m + s] @ step[:s]
        common = self.common[:, :s] @ step[:s]
        along = np.sum(runs * self.runs[:, :, -1]) + np.sum(common * self.common[:, -1])
        return float(-along - 0.5 * (np.sum(runs**2) + np.sum(common**2)))


@dataclass(frozen=True)
class Reduced:
    """The system of the shared unknowns after each run's own ones are eliminated.

    Parameters
    ----------
    own : (g, m, m + s + 1), the eliminated rows, which give a run's own unknowns for known shared ones.
    runs : (g, s + 1, s + 1), each run's QR factor over [shared | residual].
    factor : (s + 1, s + 1), QR factor of all runs and common rows.
    """

    own: Array
    runs: Array
    factor: Array

    @property
    def information(self) -> Array:
        """Information matrix of the shared unknowns, (s, s), with the runs' own unknowns fitted."""
        factor = self.factor[:-1, :-1]
        return factor.T @ factor

    def own_step(self, shared: Array) -> Array:
        """The least-squares step of the runs' own unknowns, (g, m), for a step of the shared ones."""
        m = self.own.shape[1]
        if m == 0:
            return np.zeros((self.own.shape[0], 0))
        right = self.own[:, :, m:-1] @ shared + self.own[:, :, -1]
        return np.asarray(-np.linalg.solve(self.own[:, :, :m], right[:, :, None])[:, :, 0])


def reduce(system: BorderedSystem, damping: Array) -> Reduced:
    """Eliminate each run's own unknowns and factor the remaining system.

    Parameters
    ----------
    damping : (s + g m), weights of rows that pull each unknown's step to zero; those of own unknowns must be > 0.
    """
    m, s, g = system.n_own, system.n_shared, system.runs.shape[0]
    stack = system.runs
    if m:
        held = np.zeros((g, m, m + s + 1))
        held[:, np.arange(m), np.arange(m)] = damping[s:].reshape(g, m)
        stack = np.concatenate([stack, held], axis=1)
    r: Array = np.asarray(np.linalg.qr(stack, mode="r"))
    if r.shape[1] < m + s + 1:
        r = np.concatenate([r, np.zeros((g, m + s + 1 - r.shape[1], m + s + 1))], axis=1)
    runs = r[:, m:, m:]
    held_shared = np.column_stack([np.diag(damping[:s]), np.zeros(s)])
    return Reduced(r[:, :m], runs, qr_factor(np.vstack([runs.reshape(-1, s + 1), system.common, held_shared])))
