"""Nested regressions: of a model with every candidate effect, a fit frees some and holds the others at zero."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.regression import Regression, Residuals, Rows, SelectiveRows
from vdyn_cli.inference.solution import Solution
from vdyn_cli.quantities.arrays import Array


@dataclass(frozen=True)
class _Held:
    """Rows of the full regression with some shared unknowns held and their columns removed."""

    full: Regression
    free: NDArray[np.int64]
    at: Array

    def local(self, theta: Array) -> Array:
        """The local unknowns of the full regression."""
        local = np.concatenate([self.at, theta[self.free.size :]])
        local[self.free] = theta[: self.free.size]
        return local

    def __call__(self, run: int, theta: Array) -> Rows:
        s = len(self.full.shared)
        rows = self.full.rows(run, self.local(theta))
        columns = np.concatenate([self.free, np.arange(s, rows.jacobian.shape[1])])
        plain = None if rows.plain is None else (rows.plain[0], rows.plain[1][:, columns])
        return replace(rows, jacobian=np.ascontiguousarray(rows.jacobian[:, columns]), plain=plain)


@dataclass(frozen=True)
class _HeldResiduals(_Held):
    """The same for rows whose residuals cost less without their derivatives."""

    def residual(self, run: int, theta: Array) -> Array:
        """See Residuals."""
        assert isinstance(self.full.rows, Residuals)
        return self.full.rows.residual(run, self.local(theta))


def restricted(full: Regression, held: Mapping[str, float], starts: Solution | None = None) -> Regression:
    """The regression with some shared unknowns held at given values.

    Parameters
    ----------
    full : the regression with every unknown free.
    held : values of the held unknowns by name, SI.
    starts : a solution that provides the start values of the free unknowns.
    """
    shared = full.shared
    free = np.array([i for i, u in enumerate(shared) if u.name not in held], dtype=np.int64)
    at = np.array([held.get(u.name, 0.0) for u in shared])
    kept = [shared[i] for i in free]
    run_starts = dict(full.run_starts)
    if starts is not None:
        kept = [replace(u, start=float(np.clip(starts.values.get(u.name, u.start), u.lower, u.upper))) for u in kept]
        run_starts |= dict(starts.per_run)
    held_rows = _HeldResiduals if isinstance(full.rows, Residuals) else _Held
    whole = full
    if isinstance(full.rows, SelectiveRows):
        whole = replace(full, rows=full.rows.sensitive_to([u.name for u in kept]))
    rows: Callable[[int, Array], Rows] = held_rows(whole, free, at)
    if full.narrow is not None and all(held.get(u.name, u.start) == u.start for u in shared):
        rows = full.narrow([u.name for u in kept])
    return replace(full, unknowns=(*kept, *full.own), rows=rows, run_starts=run_starts, narrow=None)


def without_priors(regression: Regression, names: Iterable[str]) -> Regression:
    """The regression without the priors of the unknowns in ``names``."""
    return regression.changed(lambda u: replace(u, prior=None), set(names))
