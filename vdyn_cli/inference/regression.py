"""A nonlinear regression over runs: its unknowns, the whitened rows of each run, and their assembly at one point."""

from __future__ import annotations

from collections.abc import Callable, Collection, Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.qr_factors import BorderedSystem, qr_factor
from vdyn_cli.quantities.arrays import Array


@dataclass(frozen=True)
class Unknown:
    """An unknown of the regression.

    Parameters
    ----------
    start, lower, upper : start value and physical range, in SI.
    prior : mean and standard deviation of the normal prior, or None.
    prior_correlation : correlation of the prior with those of other unknowns, by name; zero for those not named.
    prior_degrees : degrees of freedom of the prior's standard deviation, where it was estimated from the data.
    prior_stated : True: the user stated the prior, such as a drawing's value; False: the program estimated it.
    per_run : every run has its own value.
    nuisance : a nuisance parameter: not reported, and ignored in the choice of the independent units.
    physical : the range of an answer of the diagnosis, in which ``lower`` and ``upper`` are relaxed; None: these two.
    """

    name: str
    start: float
    lower: float = -np.inf
    upper: float = np.inf
    unit: str = ""
    prior: tuple[float, float] | None = None
    per_run: bool = False
    nuisance: bool = False
    prior_correlation: Mapping[str, float] = field(default_factory=dict)
    prior_degrees: float = np.inf
    prior_stated: bool = True
    physical: tuple[float, float] | None = None


@dataclass(frozen=True)
class Rows:
    """One run's whitened residuals (simulated minus measured) and their derivatives.

    Parameters
    ----------
    residual : (n,), in units of its noise.
    jacobian : (n, k), d residual / d local unknowns: the shared ones in order, then this run's own.
    block : (n,), label of the block of each row, or None: blocks of equal information, ordered by ``time``, or in the
        order of the rows where ``time`` is None.
    time : (n,), time of each row; needed where the rows of several channels are concatenated.
    plain : the main channel's residual (p,) in its own unit and its derivatives (p, k), before whitening.
    block_counts : (blocks,), number of rows of each block before its reduction to a QR factor; None without reduction.
    plain_root : (p, m), a square root of the noise covariance of ``plain``, where the step has a model of it.
    apart : the rows are so far apart in time that a block needs few of them.
    """

    residual: Array
    jacobian: Array
    block: NDArray[np.int64] | None = None
    time: Array | None = None
    plain: tuple[Array, Array] | None = None
    block_counts: NDArray[np.int64] | None = None
    plain_root: Array | None = None
    apart: bool = False

    @property
    def count(self) -> int:
        """Number of rows before any reduction to QR factors."""
        return self.residual.size if self.block_counts is None else int(self.block_counts.sum())


@runtime_checkable
class Residuals(Protocol):
    """Rows whose residuals can be evaluated without their derivatives at lower cost."""

    def residual(self, run: int, theta: Array) -> Array:
        """The residuals (n,) of a run, in standard deviations; ``theta`` (s + o,): shared, then own unknowns."""
        ...


@runtime_checkable
class SelectiveRows(Protocol):
    """Rows that cost less with derivatives to a few of the shared unknowns."""

    def sensitive_to(self, names: Collection[str]) -> Callable[[int, Array], Rows]:
        """The same rows, with zeros for the derivatives to other shared unknowns than these."""
        ...


@dataclass(frozen=True)
class Regression:
    """The regression to solve.

    Parameters
    ----------
    unknowns : shared and per-run unknowns, in any order.
    runs : names of the runs, for messages.
    rows : ``rows(i, theta)`` of run i at its local unknowns, shared first. It may raise ArithmeticError, or return
        values that are not finite, where the model cannot be computed.
    run_starts : (runs,) starts of a per-run unknown, by name, where one start does not suit all.
    narrow : ``narrow(names)`` gives the rows for those shared unknowns and the run's own, with all others at their
        start: for models that cost less with fewer unknowns. None where nothing is saved.
    log_noise : log |L| of the noise covariance L L', which makes the costs of regressions with different noise models
        comparable: -log likelihood = cost + log |L| + constant.
    reached : cost reached by another fit; one that does not predict a lower cost ends unconverged.
    origins : (runs,), label of the independent run of which each is a part; empty: each is independent.
    """

    unknowns: tuple[Unknown, ...]
    runs: tuple[str, ...]
    rows: Callable[[int, Array], Rows]
    run_starts: Mapping[str, Array] = field(default_factory=dict)
    narrow: Callable[[Sequence[str]], Callable[[int, Array], Rows]] | None = None
    log_noise: float = 0.0
    reached: float = np.inf
    origins: tuple[int, ...] = ()

    @cached_property
    def independent_runs(self) -> tuple[tuple[int, ...], ...]:
        """For each independent run, the indices of its parts in ``runs``."""
        of = self.origins or tuple(range(len(self.runs)))
        return tuple(tuple(k for k, one in enumerate(of) if one == label) for label in dict.fromkeys(of))

    @cached_property
    def shared(self) -> tuple[Unknown, ...]:
        """The unknowns that all runs share, (s)."""
        return tuple(u for u in self.unknowns if not u.per_run)

    @cached_property
    def own(self) -> tuple[Unknown, ...]:
        """The unknowns that have one value for each run, (m)."""
        return tuple(u for u in self.unknowns if u.per_run)

    def local(self, x: Array, run: int) -> Array:
        """One run's local unknowns (s + m), from all unknowns (s + g m): shared first, then run by run."""
        s, m = len(self.shared), len(self.own)
        return np.concatenate([x[:s], x[s + run * m : s + (run + 1) * m]])

    def start(self) -> Array:
        """Start values (s + g m): shared first, then run by run."""
        own = np.array([self.run_starts.get(u.name, np.full(len(self.runs), u.start)) for u in self.own], dtype=float)
        return np.concatenate([[u.start for u in self.shared], own.T.ravel()])

    def started(self, x: Array) -> Regression:
        """The regression with these start values (s + g m) of all unknowns: shared first, then run by run."""
        shared, m = iter(x[: len(self.shared)].tolist()), len(self.own)
        unknowns = tuple(u if u.per_run else replace(u, start=next(shared)) for u in self.unknowns)
        own = {u.name: x[len(self.shared) + i :: m] for i, u in enumerate(self.own)}
        return replace(self, unknowns=unknowns, run_starts=own)

    def changed(self, change: Callable[[Unknown], Unknown], names: Container[str] | None = None) -> Regression:
        """The regression with the unknowns of these ``names`` changed; with all of them where none are given."""
        unknowns = (change(u) if names is None or u.name in names else u for u in self.unknowns)
        return replace(self, unknowns=tuple(unknowns))

    def of_runs(self, runs: Sequence[int]) -> Regression:
        """The regression over some of the runs, by their indices."""
        return replace(
            self,
            runs=tuple(self.runs[k] for k in runs),
            rows=lambda k, theta: self.rows(runs[k], theta),
            run_starts={name: values[list(runs)] for name, values in self.run_starts.items()},
            narrow=None,
            origins=tuple(self.origins[k] for k in runs) if self.origins else (),
        )

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds, each (s + g m): shared first, then run by run."""
        every = self.shared + self.own * len(self.runs)
        return np.array([u.lower for u in every], dtype=float), np.array([u.upper for u in every], dtype=float)

    def label(self, index: int) -> str:
        """The name of one of all unknowns, with its run where it is per run."""
        s, m = len(self.shared), len(self.own)
        if index < s:
            return self.shared[index].name
        return f"{self.own[(index - s) % m].name} of {self.runs[(index - s) // m]}"


def stacked(unknowns: Sequence[Unknown], values: Mapping[str, float], per_run: Mapping[str, Array]) -> Array:
    """All unknowns (s + g m) as one vector: shared first, then run by run.

    Parameters
    ----------
    values : of shared unknowns; omitted ones have their start. per_run : (g,) values of each of the m own ones.
    """
    shared = [values.get(u.name, u.start) for u in unknowns if not u.per_run]
    own = np.array([per_run[u.name] for u in unknowns if u.per_run])
    return np.concatenate([shared, own.T.ravel()])


@dataclass(frozen=True)
class Point:
    """A regression evaluated at one point of its unknowns.

    Parameters
    ----------
    x : (s + g m), shared first, then run by run.
    cost : half the sum of squares, priors included.
    system : the linearization.
    squares : sum of squares, priors included.
    n_rows : number of rows of all runs before their reduction, plus one for each prior.
    """

    x: Array
    cost: float
    system: BorderedSystem
    squares: float
    n_rows: int


def prior_rows(unknowns: tuple[Unknown, ...], values: Array) -> Array:
    """Rows [J | r] of the priors over the unknowns: L^-1 (value - mean) / standard deviation.

    L is the Cholesky factor of the priors' correlation, the identity where they are independent.

    Parameters
    ----------
    values : (k,) of the k unknowns.

    Returns
    -------
    (m, k + 1), one row for each of the m unknowns with a prior.

    Raises
    ------
    numpy.linalg.LinAlgError : the correlations are not positive definite.
    """
    known = [(i, u.prior) for i, u in enumerate(unknowns) if u.prior is not None]
    rows = np.zeros((len(known), len(unknowns) + 1))
    for row, (i, (mean, std)) in zip(rows, known, strict=True):
        row[i], row[-1] = 1 / std, (values[i] - mean) / std
    related = [unknowns[i] for i, _ in known]
    if any(u.prior_correlation for u in related):
        correlation = np.array([[a.prior_correlation.get(b.name, float(a is b)) for b in related] for a in related])
        rows = np.asarray(np.linalg.solve(np.linalg.cholesky(correlation), rows), dtype=np.float64)
    return rows


def evaluate(regression: Regression, x: Array) -> Point | None:
    """Cost and QR factors at x (s + g m), shared first, then run by run; None where the model cannot be computed."""
    with np.errstate(over="ignore", invalid="ignore"):
        return _evaluate(regression, x)


def _evaluate(regression: Regression, x: Array) -> Point | None:
    s, m = len(regression.shared), len(regression.own)
    common = prior_rows(regression.shared, x[:s])
    squares = float(np.sum(common[:, -1] ** 2))
    cost, runs, n_rows = 0.5 * squares, [], len(common)
    for run in range(len(regression.runs)):
        local = regression.local(x, run)
        try:
            rows = regression.rows(run, local)
        except ArithmeticError:
            return None
        matrix = augmented_matrix(rows, s)
        if not np.isfinite(np.sum(matrix**2)):  # the norms of diverging sensitivities overflow
            return None
        own = prior_rows(regression.own, local[s:])
        priors = float(np.sum(own[:, -1] ** 2))
        cost += float(np.sum(0.5 * rows.residual**2)) + 0.5 * priors
        squares += float(np.sum(rows.residual**2)) + priors
        n_rows += len(own) + rows.count
        known = np.column_stack([own[:, :m], np.zeros((len(own), s)), own[:, -1]])
        runs.append(qr_factor(np.vstack([matrix, known])))
    if not np.isfinite(cost):
        return None
    return Point(x, cost, BorderedSystem(np.array(runs), common, m), squares, n_rows)


@dataclass(frozen=True)
class Objective:
    """The cost of a regression, and its linearization, as functions of all unknowns."""

    regression: Regression

    def __call__(self, x: Array) -> Point | None:
        """See ``evaluate``."""
        return evaluate(self.regression, x)

    def cost(self, x: Array) -> float:
        """The cost at x (s + g m,), infinite where there is no model; from residuals alone where that is cheaper."""
        rows = self.regression.rows
        if not isinstance(rows, Residuals):
            point = self(x)
            return np.inf if point is None else point.cost
        s = len(self.regression.shared)
        total = 0.5 * float(np.sum(prior_rows(self.regression.shared, x[:s])[:, -1] ** 2))
        with np.errstate(over="ignore", invalid="ignore"):
            for run in range(len(self.regression.runs)):
                local = self.regression.local(x, run)
                try:
                    residual = rows.residual(run, local)
                except ArithmeticError:
                    return np.inf
                own = prior_rows(self.regression.own, local[s:])[:, -1]
                total += float(np.sum(0.5 * residual**2)) + 0.5 * float(np.sum(own**2))
        return total if np.isfinite(total) else np.inf

    @property
    def cheap(self) -> bool:
        """Whether the cost can be evaluated without the linearization."""
        return isinstance(self.regression.rows, Residuals)


def augmented_matrix(rows: Rows, n_shared: int) -> Array:
    """[own | shared | residual], (n, k + 1), of rows whose Jacobian has the ``n_shared`` shared unknowns first."""
    return np.column_stack([rows.jacobian[:, n_shared:], rows.jacobian[:, :n_shared], rows.residual])
