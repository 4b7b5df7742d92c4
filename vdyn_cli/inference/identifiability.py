"""Identifiability: which unknowns, or combinations of unknowns, the data determine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Array

COLLINEAR = 1e-7  # singular value with columns of unit length: the accuracy of the sensitivities
WIDEST = 0.5  # of the physical range: an interval of a larger standard deviation (+- 2) is wider than the range
NEGLIGIBLE_PART = 0.02  # component of a direction, relative to its largest, that is omitted from the message
TIED = 0.7  # correlation from which an unknown is listed with another: half of its variance is shared


@dataclass(frozen=True)
class Unidentifiable:
    """Combinations of the unknowns that the data do not determine.

    Parameters
    ----------
    directions : (s, d), null directions: changes of the unknowns that hardly change the residual.
    members : indices of the unknowns that are involved in these directions.
    free : d of the members; with these fixed, the data determine the other members.
    """

    directions: Array
    members: tuple[int, ...]
    free: tuple[int, ...]

    def combinations(self) -> list[Array]:
        """Coefficients, (s,) each, of the identifiable combinations p_i - N_i N_F^-1 p_F."""
        free = list(self.free)
        rows = []
        for i in (i for i in self.members if i not in free):
            row = np.zeros(len(self.directions))
            row[i] = 1.0
            row[free] = -np.linalg.solve(self.directions[free].T, self.directions[i])
            rows.append(row)
        return rows


def find_unidentifiable(factor: Array, ranges: Array, lengths: Array) -> Unidentifiable | None:
    """The combinations of unknowns that are not identifiable; None where all unknowns are.

    Parameters
    ----------
    factor : (s, s), QR factor of the whitened Jacobian, per-run unknowns eliminated.
    ranges : (s,), width of each unknown's physical range; infinite where it has none.
    lengths : (s,), norms of the Jacobian's columns before the per-run unknowns were eliminated.

    An unknown is not identifiable where sensitivities are collinear to 1e-7, or where its standard deviation exceeds
    half of its physical range.
    """
    unit = np.where(lengths > 0, lengths, 1.0)
    _, values, axes = np.linalg.svd(factor / unit)
    parallel: Array = axes[values <= COLLINEAR].T
    if parallel.shape[1]:
        return _of_null_space(parallel, unit)
    inverse = np.linalg.inv(factor)
    return _of_wide(inverse @ inverse.T, ranges)


def _of_null_space(parallel: Array, unit: Array) -> Unidentifiable:
    """From null directions (s, d) for columns of unit length; ``unit`` (s,) holds the columns' norms."""
    from scipy.linalg import qr

    sizes = np.max(np.abs(parallel) / np.max(np.abs(parallel), axis=0), axis=1)
    members = [i for i, size in enumerate(sizes) if size > NEGLIGIBLE_PART]
    later = 1.0 + 1e-3 * np.arange(len(members))  # of equally suitable unknowns the last are the free ones
    order = qr((parallel[members] * later[:, None]).T, pivoting=True, mode="r")[1]
    free = sorted(members[i] for i in order[: parallel.shape[1]])
    return _of_members(parallel / unit[:, None], members, free)


def _of_wide(covariance: Array, ranges: Array) -> Unidentifiable | None:
    """From standard deviations that exceed the physical ranges: fix the widest, then the next, until none does."""
    left, free = covariance.copy(), list[int]()
    while True:
        share = np.sqrt(np.maximum(np.diag(left), 0.0)) / ranges
        worst = int(np.argmax(share))
        if share[worst] <= WIDEST:
            break
        free.append(worst)
        left = left - np.outer(left[worst], left[worst]) / left[worst, worst]
        left[worst], left[:, worst] = 0.0, 0.0
    if not free:
        return None
    free.sort()
    remaining = np.maximum(np.diag(left), 0.0) / np.diag(covariance)
    members = [i for i in range(len(ranges)) if 1.0 - remaining[i] > TIED**2 or i in free]
    return _of_members(covariance[:, free] @ np.linalg.inv(covariance[np.ix_(free, free)]), members, free)


def _of_members(directions: Array, members: Sequence[int], free: Sequence[int]) -> Unidentifiable:
    kept = np.zeros_like(directions)
    kept[list(members)] = directions[list(members)]
    return Unidentifiable(kept, tuple(members), tuple(free))


def phrase(names: Sequence[str], row: Array) -> str:
    """A linear combination as text, coefficients to two digits: ``rolling_resistance + 0.8 x drag_area``.

    Parameters
    ----------
    names : (k,). row : (k,) coefficients.
    """
    text = ""
    terms = [(name, float(f"{factor:.2g}")) for name, factor in zip(names, row, strict=True) if factor]
    for name, factor in sorted(terms, key=lambda term: term[1] != 1.0):
        term = name if abs(factor) == 1.0 else f"{abs(factor):g} x {name}"
        if text:
            text += f" {'-' if factor < 0 else '+'} {term}"
        else:
            text = f"-{term}" if factor < 0 else term
    return text
