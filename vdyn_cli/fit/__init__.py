"""Least squares over runs: shared unknowns, each run's own, honest intervals, and a refusal where data are silent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.errors import Finding, ResultError, raise_all
from vdyn_cli.fit import identifiability, intervals
from vdyn_cli.fit.intervals import Evidence, equal_information_blocks
from vdyn_cli.fit.minimise import Minimum, minimise
from vdyn_cli.fit.noise import NORMAL_FROM_MEDIAN, white_level, whiten
from vdyn_cli.fit.regression import Loss, Regression, Rows, Unknown, evaluate, matrix_of, weights
from vdyn_cli.fit.triangles import Array, Reduced, fold, reduce

__all__ = [
    "Downweighted",
    "Regression",
    "Rows",
    "Solution",
    "Unit",
    "Unknown",
    "equal_information_blocks",
    "solve",
    "white_level",
    "whiten",
]

FEWEST_RUNS = 6  # with so many runs the run is the unit of evidence
BLOCKS = 16  # otherwise so many blocks within runs,
FEWEST_BLOCKS = 12  # and not fewer than these,
FEWEST_EFFECTIVE = 6.0  # nor worth fewer equal ones than these
OUTLIER = 0.5  # a row whose weight is less is named
AT_BOUND = 1e-7  # of the physical range


@dataclass(frozen=True)
class Downweighted:
    """Neighbouring rows of one run that a robust loss took for outliers."""

    run: str
    first: int
    last: int
    weight: float

    def __str__(self) -> str:
        return f"{self.run}, rows {self.first} to {self.last}: weight {self.weight:.2g}"


@dataclass(frozen=True)
class Unit:
    """One independent piece of evidence at the solution.

    Parameters
    ----------
    run, block : index of the run, label of the block within it (0 where the run is the unit).
    triangle : (k + 1, k + 1), T'T = [J r]'[J r] over [own | shared | residual] of its rows, priors left out.
    change : (s,), change of the shared unknowns when the unit is left out.
    """

    run: int
    block: int
    triangle: Array
    change: Array


@dataclass(frozen=True)
class Solution:
    """The answer, with what it is worth.

    Parameters
    ----------
    names : the shared unknowns, in the order of every matrix here.
    values, std, interval95 : of the shared unknowns; from units of evidence unless ``unit`` is "model".
    per_run, per_run_std : (runs,) of each per-run unknown; these standard deviations are the noise model's.
    covariance : (s, s), of the values.
    classical_covariance : (s, s), the textbook's: sum of squares / (rows - unknowns) x inverse information.
    cost : half the sum of squares (or of losses), priors included.
    residuals : per run, at the solution.
    unit, n_units, effective_units : what was taken as independent, how many there were, and how many equal ones they
        are worth for the least favoured unknown.
    degrees : of Student's t, for each shared unknown.
    """

    names: tuple[str, ...]
    values: Mapping[str, float]
    std: Mapping[str, float]
    interval95: Mapping[str, tuple[float, float]]
    per_run: Mapping[str, Array]
    per_run_std: Mapping[str, Array]
    covariance: Array
    classical_covariance: Array
    cost: float
    residuals: tuple[Array, ...]
    unit: Literal["run", "block", "model"]
    n_units: int
    effective_units: float
    degrees: Mapping[str, float]
    units: tuple[Unit, ...]
    downweighted: tuple[Downweighted, ...]
    warnings: tuple[str, ...]
    iterations: int

    @property
    def correlation(self) -> dict[str, dict[str, float]]:
        """Correlation of the shared unknowns, by name."""
        size = np.sqrt(np.diag(self.covariance))
        matrix = self.covariance / np.where(size > 0, np.outer(size, size), 1.0)
        return {a: {b: float(matrix[i, j]) for j, b in enumerate(self.names)} for i, a in enumerate(self.names)}

    @property
    def classical_std(self) -> dict[str, float]:
        """The textbook's standard errors, which count samples as if they were independent."""
        return dict(zip(self.names, np.sqrt(np.diag(self.classical_covariance)).tolist(), strict=True))

    def std_of(self, gradient: Mapping[str, float] | Array) -> float:
        """Standard deviation, to first order, of a function of the shared unknowns with this gradient."""
        g = self._gradient(gradient)
        return float(np.sqrt(max(float(g @ self.covariance @ g), 0.0)))

    def interval_of(self, value: float, gradient: Mapping[str, float] | Array) -> tuple[float, float]:
        """95 % interval, to first order, of a function of the shared unknowns with this value and gradient."""
        parts = np.abs(self._gradient(gradient)) * np.sqrt(np.diag(self.covariance))
        degrees = [self.degrees[n] for n, p in zip(self.names, parts, strict=True) if p > 1e-3 * parts.max()]
        half = intervals.t_quantile(min(degrees)) * self.std_of(gradient) if degrees else 0.0
        return value - half, value + half

    def _gradient(self, gradient: Mapping[str, float] | Array) -> Array:
        if isinstance(gradient, Mapping):
            if strange := sorted(set(gradient) - set(self.names)):
                raise KeyError(f"not among the shared unknowns: {', '.join(strange)}")
            return np.array([float(gradient.get(n, 0.0)) for n in self.names])
        return np.asarray(gradient, dtype=float)


def solve(
    regression: Regression,
    *,
    robust: Loss = "none",
    units: Literal["auto", "run", "block"] = "auto",
    most_iterations: int = 200,
) -> Solution:
    """Fit shared and per-run unknowns to all runs at once, and say what the answer is worth.

    Minimises sum over runs and rows of rho(r), plus half the squares of the priors, within the physical ranges;
    rho(r) = r^2 / 2 unless robust.

    Parameters
    ----------
    robust : "huber" or "soft_l1" give outliers less weight, and ``downweighted`` names them.
    units : what is independent; "auto" takes runs where they are many, else blocks within runs.
    most_iterations : steps of the fit before it is given up.

    Raises
    ------
    ResultError
        The fit does not converge; the data do not determine the unknowns (the combination that they do determine is
        named); or a value lies at its bound.
    """
    minimum, scale = _minimise(regression, robust, most_iterations)
    solved = _Solved(regression, minimum, robust, scale)
    raise_all(_undetermined(solved), ResultError)
    raise_all(_unconverged(solved), ResultError)
    raise_all(_at_bounds(solved), ResultError)
    return _judge(solved, units)


class _Solved:
    """A minimum, and what every later question about it needs."""

    def __init__(self, regression: Regression, minimum: Minimum, loss: Loss, scale: float) -> None:
        self.regression, self.minimum, self.loss, self.scale = regression, minimum, loss, scale
        self.point = minimum.point
        self.s, self.m = len(regression.shared), len(regression.own)
        weak = self.point.arrow.column_norms() * 1e-9
        weak = np.where(weak > 0, weak, 1.0)
        weak[: self.s] = 0.0
        self.reduced: Reduced = reduce(self.point.arrow, weak)
        squares = float(np.sum(self.point.arrow.runs[:, :, -1] ** 2) + np.sum(self.point.arrow.common[:, -1] ** 2))
        n_rows = self.point.n_rows + sum(u.prior is not None for u in regression.shared + regression.own)
        self.variance = squares / max(n_rows - len(self.point.x), 1)

    @cached_property
    def information(self) -> Array:
        """Inverse information about the shared unknowns, (s, s)."""
        inverse = np.linalg.inv(self.reduced.triangle[: self.s, : self.s]) if self.s else np.zeros((0, 0))
        return inverse @ inverse.T

    @cached_property
    def own(self) -> Array:
        """Covariance of each run's own unknowns were the shared ones known, (g, m, m)."""
        inverse = np.linalg.inv(self.reduced.own[:, :, : self.m])
        return np.asarray(inverse @ inverse.transpose(0, 2, 1))

    @cached_property
    def follow(self) -> Array:
        """How each run's own unknowns follow the shared ones, (g, m, s)."""
        return np.asarray(-np.linalg.solve(self.reduced.own[:, :, : self.m], self.reduced.own[:, :, self.m : -1]))

    def own_covariance(self, run: int) -> Array:
        """Inverse information about one run's own unknowns, (m, m)."""
        return np.asarray(self.own[run] + self.follow[run] @ self.information @ self.follow[run].T)

    def ranges(self) -> Array:
        return np.array([u.upper - u.lower for u in self.regression.shared])


def _minimise(regression: Regression, loss: Loss, most_iterations: int) -> tuple[Minimum, float]:
    """The minimum; for a robust loss the scale of the residuals is found with it, from their median."""
    lower, upper = regression.bounds()

    def run(start: Array, loss: Loss, scale: float) -> Minimum:
        try:
            return minimise(lambda x: evaluate(regression, x, loss, scale), start, lower, upper, most_iterations)
        except ArithmeticError as error:
            raise ResultError(
                Finding("fit", str(error), _words(regression, start), "check the start values and the logs for gaps")
            ) from error

    minimum, scale = run(regression.start(), "none", 1.0), 1.0
    if loss == "none":
        return minimum, scale
    for _ in range(20):
        x = minimum.point.x
        residual = np.concatenate(
            [regression.rows(i, regression.local(x, i)).residual for i in range(len(regression.runs))]
        )
        before, scale = scale, NORMAL_FROM_MEDIAN * float(np.median(np.abs(residual)))
        scale = scale or float(np.sqrt(np.mean(residual**2))) or 1.0
        minimum = run(x, loss, scale)
        if abs(scale - before) < 1e-3 * before:
            break
    return minimum, scale


def _words(regression: Regression, x: Array) -> str:
    return ", ".join(f"{u.name} = {v:.4g} {u.unit}".strip() for u, v in zip(regression.shared, x, strict=False))


def _undetermined(solved: _Solved) -> list[Finding]:
    """What the data leave open, and which combination they hold."""
    regression, s, m = solved.regression, solved.s, solved.m
    findings = []
    for run, rows in enumerate(solved.reduced.own):
        norms = np.linalg.norm(solved.point.arrow.runs[run, :, :m], axis=0)
        silent = [u.name for u, n in zip(regression.own, norms, strict=True) if n == 0]
        if not silent and m:
            values, axes = np.linalg.svd(rows[:, :m] / norms)[1:]
            loose = np.abs(axes[values < identifiability.SINGULAR * values.max()])
            silent = [u.name for i, u in enumerate(regression.own) if loose.size and loose[:, i].max() > 0.1]
        if silent:
            findings.append(
                Finding(regression.runs[run], f"the run does not determine {_list(silent)}", "", "leave the run out")
            )
    if not s:
        return findings
    triangle = solved.reduced.triangle[:s, :s] / max(np.sqrt(solved.variance), 1.0)
    ranges = solved.ranges()
    directions = identifiability.undetermined(triangle, ranges)
    if directions.shape[1]:
        names = [u.name for u in regression.shared]
        x = solved.point.x[:s]
        scale = np.where(np.isfinite(ranges), ranges, np.maximum(np.abs(x), 1e-6 * np.abs(x).max() + 1e-300))
        words, rows, open_ones = identifiability.combinations(names, directions, scale)
        held = [f"{w} = {float(r @ x):.4g}" for w, r in zip(words, rows, strict=True)]
        what = f"only {' and '.join(held)} is determined" if held else f"the data do not determine {_list(open_ones)}"
        remedy = f"fix {' or '.join(open_ones)}, or add runs that tell them apart" if held else "fix it or add data"
        findings.append(Finding("fit", what, "", remedy))
    return findings


def _list(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _unconverged(solved: _Solved) -> list[Finding]:
    if solved.minimum.converged:
        return []
    step, x = solved.minimum.step, solved.point.x
    worst = int(np.argmax(np.abs(step) / np.maximum(np.abs(x), 1e-300)))
    got = f"{solved.regression.label(worst)} = {x[worst]:.4g}, still moving by {step[worst]:.2g}"
    what = f"the fit did not converge in {solved.minimum.iterations} iterations"
    return [Finding("fit", what, got, "start closer, fix an unknown, or check the logs")]


def _at_bounds(solved: _Solved) -> list[Finding]:
    regression, x = solved.regression, solved.point.x
    lower, upper = regression.bounds()
    every = regression.shared + regression.own * len(regression.runs)
    findings = []
    for i, u in enumerate(every):
        width = u.upper - u.lower
        near = AT_BOUND * (width if np.isfinite(width) else max(abs(x[i]), 1e-12))
        for bound, which in ((lower[i], "lower"), (upper[i], "upper")):
            if abs(x[i] - bound) <= near:
                findings.append(
                    Finding(
                        "fit",
                        f"{regression.label(i)} lies at its {which} bound",
                        f"{bound:g} {u.unit}".strip(),
                        "a physical value lies inside: check signs, units and fixed values, or widen the range",
                    )
                )
    return findings


def _judge(solved: _Solved, wanted: Literal["auto", "run", "block"]) -> Solution:
    regression, s, m = solved.regression, solved.s, solved.m
    names = tuple(u.name for u in regression.shared)
    by_run = wanted == "run" or (wanted == "auto" and len(regression.runs) >= FEWEST_RUNS)
    units, residuals, downweighted = _units(solved, by_run)
    warnings = [f"down-weighted {d}" for d in downweighted]
    found = intervals.spread([_evidence(solved, u, by_run) for u in units], solved.information)
    asked = [not u.nuisance for u in regression.shared]
    effective = float(np.min(found.effective, where=asked or [True] * s, initial=len(units)))
    many = len(units) >= FEWEST_BLOCKS and effective >= FEWEST_EFFECTIVE
    enough = len(units) >= 2 and (wanted != "auto" or by_run or many)
    classical = solved.variance * solved.information
    if enough:
        stated = _from_priors(solved, by_run)
        covariance = found.covariance + stated
        # Satterthwaite: what the units scatter has few degrees of freedom, what the priors state has none to lose.
        degrees = found.degrees * (np.diag(covariance) / np.diag(found.covariance)) ** 2
    else:
        covariance, degrees = classical, np.full(s, float(max(solved.point.n_rows - len(solved.point.x), 1)))
        warnings.append(
            f"the intervals rest on the noise model alone: {len(units)} units of evidence, worth {effective:.1f} equal "
            f"ones, are too few to judge by (at least {FEWEST_BLOCKS}, worth {FEWEST_EFFECTIVE:g})"
        )
    values, std = solved.point.x[:s], np.sqrt(np.diag(covariance))
    half = [intervals.t_quantile(d) * e for d, e in zip(degrees, std, strict=True)]
    own = solved.point.x[s:].reshape(len(regression.runs), m)
    own_std = np.sqrt(solved.variance * np.array([np.diag(solved.own_covariance(k)) for k in range(len(own))]))
    return Solution(
        names=names,
        values=dict(zip(names, values.tolist(), strict=True)),
        std=dict(zip(names, std.tolist(), strict=True)),
        interval95={n: (float(v - h), float(v + h)) for n, v, h in zip(names, values, half, strict=True)},
        per_run={u.name: own[:, i] for i, u in enumerate(regression.own)},
        per_run_std={u.name: own_std[:, i] for i, u in enumerate(regression.own)},
        covariance=covariance,
        classical_covariance=classical,
        cost=solved.point.cost,
        residuals=residuals,
        unit=("run" if by_run else "block") if enough else "model",
        n_units=len(units),
        effective_units=effective,
        degrees=dict(zip(names, degrees.tolist(), strict=True)),
        units=tuple(Unit(u.run, u.block, u.triangle, c) for u, c in zip(units, found.changes, strict=True)),
        downweighted=tuple(downweighted),
        warnings=tuple(warnings),
        iterations=solved.minimum.iterations,
    )


def _from_priors(solved: _Solved, by_run: bool) -> Array:
    """What the priors' own uncertainty adds to the covariance of the shared unknowns.

    The scatter of blocks cannot show it: a prior says the same to every block. Where the run is the unit, the runs'
    own priors are within it already.
    """
    rows = [np.eye(solved.s)[i] / u.prior[1] for i, u in enumerate(solved.regression.shared) if u.prior]
    if not by_run:
        own = [(i, u.prior[1]) for i, u in enumerate(solved.regression.own) if u.prior]
        rows += [follow[i] / std for follow in solved.follow for i, std in own]
    moved = np.array(rows).reshape(-1, solved.s) @ solved.information
    return np.asarray(moved.T @ moved)


def _evidence(solved: _Solved, unit: Unit, by_run: bool) -> Evidence:
    if by_run:
        return Evidence(unit.run, solved.reduced.runs[unit.run], np.zeros((0, 0)), np.zeros((0, solved.s)))
    return Evidence(unit.run, unit.triangle, solved.own[unit.run], solved.follow[unit.run])


def _units(solved: _Solved, by_run: bool) -> tuple[list[Unit], tuple[Array, ...], list[Downweighted]]:
    """Second pass, at the solution: triangles per unit, residuals, outliers."""
    regression, s = solved.regression, solved.s
    units: list[Unit] = []
    residuals, downweighted = [], []
    for run, name in enumerate(regression.runs):
        rows = regression.rows(run, regression.local(solved.point.x, run))
        matrix = matrix_of(rows, s, solved.loss, solved.scale)
        if by_run:
            labels = np.zeros(len(matrix), dtype=np.int64)
        elif rows.block is not None:
            labels = np.unique(rows.block, return_inverse=True)[1].astype(np.int64)
        else:
            labels = _cut(solved, run, rows, matrix)
        for label in range(int(labels.max(initial=-1)) + 1):
            units.append(Unit(run, label, fold(matrix[labels == label]), np.zeros(s)))
        residuals.append(rows.residual)
        downweighted += _outliers(name, rows.residual, solved)
    return units, tuple(residuals), downweighted


def _cut(solved: _Solved, run: int, rows: Rows, matrix: Array) -> NDArray[np.int64]:
    """Blocks of equal information about the shared unknowns within one run, in the order of time."""
    m, whole = solved.m, solved.reduced.runs[run, :, :-1]
    total = matrix[:, m:-1] + matrix[:, :m] @ solved.follow[run]
    told = np.sum((total @ solved.information) * total, axis=1)
    share = float(np.sum((whole @ solved.information) * whole)) / max(solved.s, 1)
    order = np.argsort(rows.time, kind="stable") if rows.time is not None else np.arange(len(told))
    labels = np.empty(len(told), dtype=np.int64)
    labels[order] = equal_information_blocks(told[order], max(1, round(BLOCKS * share)))
    return labels


def _outliers(run: str, residual: Array, solved: _Solved) -> list[Downweighted]:
    if solved.loss == "none":
        return []
    weight = weights(residual, solved.loss, solved.scale)
    at = np.flatnonzero(weight < OUTLIER)
    groups = np.split(at, np.flatnonzero(np.diff(at) > 3) + 1) if at.size else []
    return [Downweighted(run, int(g[0]), int(g[-1]), float(np.mean(weight[g]))) for g in groups]
