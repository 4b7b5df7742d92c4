"""A regression linearized at one point and cut into independent units, the input of the score tests.

Sign: the residual here is measured minus simulated, so that y = J d + noise; a positive score raises the unknown.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.inference import Regression, Rows, Unknown
from vdyn_cli.inference.intervals import effective_number
from vdyn_cli.inference.linearized_regression import BLOCKS, blocks_of, blocks_within
from vdyn_cli.inference.qr_factors import orthonormal, qr_factor
from vdyn_cli.inference.regression import Residuals, prior_rows
from vdyn_cli.quantities.arrays import Array

# In place of the run of a unit: priors that the user stated, whose std was estimated from these data, or is assumed
STATED_PRIOR, ESTIMATED_PRIOR, ASSUMED_PRIOR = -1, -2, -3


@dataclass(frozen=True)
class LinearizedRuns:
    """Residuals and sensitivities of every run at one point.

    Parameters
    ----------
    regression : its shared unknowns are those of the baseline, then those of all candidates.
    shared, own : (s,) and (runs, m), the point of linearization.
    rows : residual and Jacobian of each run.
    """

    regression: Regression
    shared: Array
    own: Array
    rows: tuple[Rows, ...]


def linearize(
    regression: Regression,
    shared: Mapping[str, float],
    own: Mapping[str, Array],
    secants: Mapping[str, float] = MappingProxyType({}),
) -> LinearizedRuns:
    """Residuals and their derivatives with respect to all unknowns at one point.

    Parameters
    ----------
    shared : values of shared unknowns; unlisted ones are at their starts.
    own : (runs,), values of each of the runs' own unknowns.
    secants : amplitude over which a secant replaces the slope, for unknowns that may have no slope at zero.

    Raises
    ------
    ArithmeticError : the model has no finite value there.
    """
    values = np.array([shared.get(u.name, u.start) for u in regression.shared])
    runs = len(regression.runs)
    each = np.array([own[u.name] for u in regression.own], dtype=float).reshape(len(regression.own), runs).T
    rows = tuple(regression.rows(k, np.concatenate([values, each[k]])) for k in range(len(regression.runs)))
    if not all(np.all(np.isfinite(r.residual)) and np.all(np.isfinite(r.jacobian)) for r in rows):
        raise ArithmeticError("the model has no finite derivatives at the fit")
    names = [u.name for u in regression.shared]
    for name, size in secants.items():
        rows = _with_secant(regression, values, each, rows, names.index(name), size)
    return LinearizedRuns(regression, values, each, rows)


def initial_values(regression: Regression) -> dict[str, Array]:
    """Values (runs,) of each of the runs' own unknowns without a fit: the mean of their prior, else their start."""
    runs = len(regression.runs)
    return {
        u.name: np.full(runs, u.prior[0])
        if u.prior
        else np.asarray(regression.run_starts.get(u.name, np.full(runs, u.start)), dtype=np.float64)
        for u in regression.own
    }


def _with_secant(
    regression: Regression, values: Array, own: Array, rows: tuple[Rows, ...], place: int, size: float
) -> tuple[Rows, ...]:
    """The rows with one column replaced by its secant if the slope is less than ``secant_ratio`` of that."""
    moved = values.copy()
    moved[place] += size
    simulate = regression.rows
    if regression.narrow is not None:
        used = [i for i, u in enumerate(regression.shared) if i == place or u.start != 0.0 or moved[i] != 0.0]
        simulate, moved = regression.narrow([regression.shared[i].name for i in used]), moved[used]
    at = [np.concatenate([moved, each]) for each in own]
    try:
        if isinstance(simulate, Residuals):
            there = [simulate.residual(k, x) for k, x in enumerate(at)]
        else:
            there = [simulate(k, x).residual for k, x in enumerate(at)]
    except ArithmeticError:
        return rows
    secant = [(a - b.residual) / size for a, b in zip(there, rows, strict=True)]
    slope = sum(float(np.sum(r.jacobian[:, place] ** 2)) for r in rows)
    if not slope < POLICY.secant_ratio**2 * sum(float(t @ t) for t in secant):
        return rows
    changed = []
    for one, column in zip(rows, secant, strict=True):
        jacobian = one.jacobian.copy()
        jacobian[:, place] = column
        changed.append(replace(one, jacobian=jacobian))
    return tuple(changed)


@dataclass(frozen=True)
class LinearizedSystem:
    """The whitened linear system y = J d + noise; the rows of each unit are compressed to their QR factor.

    Parameters
    ----------
    names : of the columns: the shared unknowns, then (if blocks are the units) every run's own as ``name#run``.
    columns : (n, p), J; y : (n,).
    label : (n,), the unit of each row, ascending.
    run : (units,), the run of each unit; STATED_PRIOR, ESTIMATED_PRIOR or ASSUMED_PRIOR for a prior.
    counts : (units,), number of rows of each before compression.
    kind : whether a unit is a run or a block of time.
    """

    names: tuple[str, ...]
    columns: Array
    y: Array
    label: NDArray[np.int64]
    run: NDArray[np.int64]
    counts: NDArray[np.int64]
    kind: Literal["run", "block"]

    @property
    def prior_units(self) -> int:
        """Number of units that are priors."""
        return int(np.count_nonzero(self.run < 0))

    @property
    def units(self) -> int:
        """Number of units: blocks or runs, and priors."""
        return len(self.run)

    @cached_property
    def _index(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self.names)}

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """First row of each unit, (units,), for sums over units (rows are in the order of units)."""
        return np.searchsorted(self.label, np.arange(self.units)).astype(np.int64)

    def columns_of(self, names: Sequence[str]) -> Array:
        """The columns of these unknowns, (n, k)."""
        return self.columns[:, [self._index[n] for n in names]]

    @cached_property
    def own(self) -> list[str]:
        """Names of the columns of the runs' own unknowns."""
        return [n for n in self.names if "#" in n]

    @cached_property
    def effective_units(self) -> float:
        """Effective number of units, without priors, by their information about all unknowns together."""
        information = np.add.reduceat(np.sum(orthonormal(self.columns) ** 2, axis=1), self.starts)
        return float(effective_number(information[self.run >= 0][:, None])[0]) if np.any(self.run >= 0) else 0.0

    def by_run(self) -> LinearizedSystem:
        """The same rows with whole runs as units, for effects that vary between runs."""
        if self.kind == "run":
            return self
        of_row = self.run[self.label]
        known = of_row < 0
        runs = np.unique(of_row[~known])
        label = np.searchsorted(runs, of_row).astype(np.int64)
        priors, which = np.unique(self.label[known], return_inverse=True)
        label[known] = runs.size + which
        order = np.argsort(label, kind="stable")
        units = np.concatenate([runs, self.run[priors]])
        counts = np.array([self.counts[self.run == k].sum() for k in runs], dtype=np.int64)
        counts = np.concatenate([counts, np.ones(len(units) - len(runs), dtype=np.int64)])
        return LinearizedSystem(self.names, self.columns[order], self.y[order], label[order], units, counts, "run")


class Projection:
    """What fitted unknowns do not explain of a system: y and columns orthogonal to the fitted ones.

    Parameters
    ----------
    fitted : shared unknowns; the runs' own are fitted, too.
    """

    def __init__(self, system: LinearizedSystem, fitted: Sequence[str]) -> None:
        self.system, self.basis = system, orthonormal(system.columns_of([*fitted, *system.own]))
        self.y = self.orthogonal(system.y)

    def orthogonal(self, columns: Array) -> Array:
        """The part of columns (n,) or (n, k) that is orthogonal to the fitted ones."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))

    def information(self, names: Sequence[str]) -> tuple[Array, Array]:
        """Information (k, k) and score (k,) of these unknowns beside the fitted ones."""
        left = self.orthogonal(self.system.columns_of(names))
        return left.T @ left, left.T @ self.y


def linearized_system(linear: LinearizedRuns) -> LinearizedSystem:
    """Cut the rows into units and compress each to its QR factor; every prior is one unit.

    The units are the runs from ``runs_as_units`` of them on, with their own unknowns eliminated; else blocks of time.
    Parts of a run are one run.
    """
    regression = linear.regression
    by_run = len(regression.independent_runs) >= POLICY.runs_as_units
    names = [u.name for u in regression.shared]
    if not by_run:
        names += [f"{u.name}#{k}" for k in range(len(regression.runs)) for u in regression.own]
    units = [*(_whole_runs(linear) if by_run else _blocks(linear)), *_shared_priors(linear, len(names))]
    rows = np.vstack([unit.rows for unit in units])
    system = LinearizedSystem(
        names=tuple(names),
        columns=rows[:, :-1],
        y=rows[:, -1],
        label=np.repeat(np.arange(len(units), dtype=np.int64), [len(unit.rows) for unit in units]),
        run=np.array([unit.run for unit in units], dtype=np.int64),
        counts=np.array([unit.n_rows for unit in units], dtype=np.int64),
        kind="block",
    )
    return system.by_run() if by_run else system


class _UnitRows(NamedTuple):
    """One unit's rows over [names of the system | y], its run as in ``LinearizedSystem``, and its rows before QR."""

    rows: Array
    run: int
    n_rows: int


def _whole_runs(linear: LinearizedRuns) -> Iterator[_UnitRows]:
    """Each part of a run, with its own unknowns eliminated."""
    m = len(linear.regression.own)
    for run, k in _parts(linear.regression):
        matrix, priors = rows_of_run(linear, k)
        yield _UnitRows(qr_factor(np.vstack([matrix, priors]))[m:, m:], run, linear.rows[k].count)


def _blocks(linear: LinearizedRuns) -> Iterator[_UnitRows]:
    """The blocks of each run, an equal number in each, and the priors of its own unknowns."""
    regression = linear.regression
    s, m, runs = len(regression.shared), len(regression.own), len(regression.runs)
    for run, k in _parts(regression):
        rows, (matrix, priors) = linear.rows[k], rows_of_run(linear, k)
        for i, block in enumerate(blocks_of(rows, matrix, blocks_within(rows, -(-BLOCKS // runs)))):
            count = len(block) if rows.block_counts is None else int(rows.block_counts[i])
            yield _UnitRows(_spread(qr_factor(matrix[block]), s, m, k, runs), run, count)
        for prior in priors:
            yield _UnitRows(_spread(prior[None], s, m, k, runs), STATED_PRIOR, 1)


def _shared_priors(linear: LinearizedRuns, columns: int) -> Iterator[_UnitRows]:
    """The prior of each shared unknown, in a system with this number of columns."""
    shared = linear.regression.shared
    kinds = [_kind_of_prior(u) for u in shared if u.prior]
    for row, kind in zip(prior_rows(shared, linear.shared), kinds, strict=True):
        wide = np.concatenate([row[:-1], np.zeros(columns - len(shared)), -row[-1:]])
        yield _UnitRows(wide[None], kind, 1)


def _kind_of_prior(unknown: Unknown) -> int:
    if unknown.prior_stated:
        return STATED_PRIOR
    return ESTIMATED_PRIOR if np.isfinite(unknown.prior_degrees) else ASSUMED_PRIOR


def _parts(regression: Regression) -> list[tuple[int, int]]:
    """Index of the independent run, and of the part, for each part in the order of ``regression.runs``."""
    each = [(run, part) for run, parts in enumerate(regression.independent_runs) for part in parts]
    return sorted(each, key=lambda pair: pair[1])


def rows_of_run(linear: LinearizedRuns, k: int) -> tuple[Array, Array]:
    """The rows (n, m + s + 1) of one part of a run, and of the priors of its own unknowns, over [own | shared | y]."""
    s, m, rows = len(linear.regression.shared), len(linear.regression.own), linear.rows[k]
    priors = prior_rows(linear.regression.own, linear.own[k])
    return (
        np.column_stack([rows.jacobian[:, s:], rows.jacobian[:, :s], -rows.residual]),
        np.column_stack([priors[:, :m], np.zeros((len(priors), s)), -priors[:, -1]]),
    )


def column_groups(names: Mapping[str, Sequence[str]]) -> dict[str, NDArray[np.int64]]:
    """By group, the indices (k,) of its columns among the columns of all groups, which follow each other."""
    ends = np.cumsum([0, *(len(each) for each in names.values())])
    return {name: np.arange(first, last) for name, first, last in zip(names, ends[:-1], ends[1:], strict=True)}


def _spread(rows: Array, s: int, m: int, run: int, runs: int) -> Array:
    """Rows over [own | shared | y] as rows over [shared | every run's own | y]."""
    wide = np.zeros((len(rows), s + m * runs + 1))
    wide[:, :s], wide[:, -1] = rows[:, m:-1], rows[:, -1]
    wide[:, s + m * run : s + m * (run + 1)] = rows[:, :m]
    return wide
