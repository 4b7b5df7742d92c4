"""How much a log can tell at best: Fisher information of the plant's own experiments, by finite differences.

The inverse of the information is the Cramer-Rao bound; ``bound`` gives the standard deviations it allows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky_banded, solve_banded

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Information:
    """``matrix`` is the Fisher information about ``names``, nuisances and prior knowledge of them included."""

    names: tuple[str, ...]
    matrix: Array

    def bound(self) -> dict[str, float]:
        """Least standard deviation of each unknown, the others being unknown too."""
        scale = np.sqrt(np.diag(self.matrix))
        covariance = np.linalg.inv(self.matrix / np.outer(scale, scale)) / np.outer(scale, scale)
        return dict(zip(self.names, np.sqrt(np.diag(covariance)).tolist(), strict=True))

    def reduced(self, keep: Iterable[str]) -> Information:
        """The information about ``keep`` alone, every other unknown having been estimated beside them."""
        keep = tuple(keep)
        mine = [self.names.index(name) for name in keep]
        rest = [k for k in range(len(self.names)) if k not in mine]
        inner = self.matrix[np.ix_(mine, mine)]
        if rest:
            cross = self.matrix[np.ix_(mine, rest)]
            inner = inner - cross @ np.linalg.solve(self.matrix[np.ix_(rest, rest)], cross.T)
        return Information(keep, inner)

    def known(self, names: Iterable[str]) -> Information:
        """The same with ``names`` given exactly instead of being unknown."""
        drop = set(names)
        left = [k for k, name in enumerate(self.names) if name not in drop]
        return Information(tuple(self.names[k] for k in left), self.matrix[np.ix_(left, left)])


def total(parts: Iterable[Information]) -> Information:
    """The sum of independent logs' information; unknowns of one name are one unknown."""
    parts = tuple(parts)
    assert all(len(set(part.names)) == len(part.names) for part in parts), "two unknowns of one log share a name"
    names = tuple(dict.fromkeys(name for part in parts for name in part.names))
    matrix = np.zeros((len(names), len(names)))
    for part in parts:
        place = [names.index(name) for name in part.names]
        matrix[np.ix_(place, place)] += part.matrix
    return Information(names, matrix)


def prior(sd: Mapping[str, float]) -> Information:
    """Knowledge from elsewhere: each unknown within its standard deviation."""
    return Information(tuple(sd), np.diag([value**-2.0 for value in sd.values()]))


def slopes(function: Callable[[Array], Array], at: Array, steps: Array) -> Array:
    """d function / d unknown, shape (values, unknowns), by central differences.

    ``function`` takes a batch (batch, unknowns) and gives (batch, values), so that a plant can run all at once.
    """
    shifts = np.diag(steps)
    values = function(np.concatenate([at + shifts, at - shifts]))
    count = len(at)
    result: Array = ((values[:count] - values[count:]) / (2.0 * steps[:, None])).T
    return result


def effect_slopes(
    function: Callable[[Mapping[str, float]], Array],
    hidden: Mapping[str, float],
    names: Sequence[str],
    steps: Mapping[str, float],
    one_sided: Iterable[str] = (),
) -> Array:
    """d function / d size of each effect about the hidden sizes, shape (values, names).

    Central differences; the chord from nothing to a whole step for those of ``one_sided`` that are not there: what
    can only be positive, or has no derivative at nothing (play, dry friction).
    """
    nothing = function(hidden)
    columns = [np.zeros((nothing.size, 0))]
    for name in names:
        by, size = steps[name], hidden.get(name, 0.0)
        if name in one_sided and size == 0.0:
            column = (function({**hidden, name: by}) - nothing) / by
        else:
            ends = function({**hidden, name: size + by}), function({**hidden, name: size - by})
            column = (ends[0] - ends[1]) / (2.0 * by)
        columns.append(column[:, None])
    return np.hstack(columns)


def from_means(names: Iterable[str], mean: Callable[[Array], Array], at: Array, steps: Array, sd: Array) -> Information:
    """Readings = mean(unknowns) + white noise of the given standard deviations (one per reading)."""
    whitened = slopes(mean, at, steps) / sd[:, None]
    return Information(tuple(names), whitened.T @ whitened)


def from_constraints(names: Iterable[str], by_unknown: Array, band: Array) -> Information:
    """Readings that fulfil constraints g(true values, unknowns) = 0, the true values themselves being unknown.

    Eliminating the true values leaves J' S^-1 J with J = dg/d unknowns and S = G Sigma G' the covariance of g at the
    readings, here banded (``band``: lower form of scipy's banded Cholesky).
    """
    factor = cholesky_banded(band, lower=True)
    whitened = solve_banded((band.shape[0] - 1, 0), factor, by_unknown)
    return Information(tuple(names), whitened.T @ whitened)
