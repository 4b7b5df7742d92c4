"""The units of evidence at a minimum, what they say together, and the solution that rests on them."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import intervals
from vdyn_cli.inference.intervals import Evidence, equal_information_blocks
from vdyn_cli.inference.normal_system import Solved
from vdyn_cli.inference.qr_factors import Array, fold
from vdyn_cli.inference.regression import Rows, matrix_of, prior_rows, weights
from vdyn_cli.inference.solution import Downweighted, Solution, Unit

Kind = Literal["run", "block"]

FEWEST_RUNS = 6  # with so many runs, if they are even enough, the run is the unit of evidence
BLOCKS = 12  # otherwise so many blocks within runs: more are shorter, and share what color the whitening left
PER_UNKNOWN = 3  # blocks at least for each shared unknown: fewer would fit them one by one and hardly scatter
FEWEST_BLOCKS = 8
FEWEST_EFFECTIVE = 4.0  # units worth fewer equal ones than this are too uneven to judge by
OUTLIER = 0.3  # a row whose weight is less is named
MOSTLY_STATED = 1e4  # times the data's variance: what the data tell is then next to nothing beside what was stated
STRAINED = 4.5  # standard deviations from a prior: something else is wrong
NEIGHBORS = 3  # rows apart: outliers this near are named together


def _strained(solved: Solved) -> list[str]:
    """Stated values that the data contradict."""
    regression, x = solved.regression, solved.point.x
    every = regression.shared + regression.own * len(regression.runs)
    found = []
    for i, unknown in enumerate(every):
        if unknown.prior is not None:
            mean, std = unknown.prior
            off = (x[i] - mean) / std
            if abs(off) > STRAINED:
                what = f"{regression.label(i)} comes out at {x[i]:.4g} {unknown.unit}".strip()
                found.append(f"{what}, {abs(off):.0f} standard deviations from the {mean:.4g} that was stated")
    return found


def judge(solved: Solved, wanted: Literal["auto", "run", "block"]) -> Solution:
    """The solution, its intervals from whole runs or blocks where there are enough, else from the noise model."""
    kind: Kind = ("run" if _enough_runs(solved) else "block") if wanted == "auto" else wanted
    units, residuals, downweighted = _units(solved, kind)
    found = intervals.spread([_evidence(solved, u, kind) for u in units], solved.covariance)
    effective = _least(solved, found.effective, len(units))
    many = len(units) >= FEWEST_BLOCKS and effective >= FEWEST_EFFECTIVE
    warnings = [f"down-weighted {d}" for d in downweighted] + _strained(solved)
    classical = solved.variance * solved.covariance
    if len(units) >= 2 and (kind == "run" or many or wanted == "block"):
        covariance, degrees = _with_priors(solved, kind, found)
        unit: Literal["run", "block", "model"] = kind
    else:
        covariance, degrees, unit = classical, np.full(solved.s, solved.degrees), "model"
        warnings.append(
            f"the intervals rest on the noise model alone: {len(units)} units of evidence, worth {effective:.1f} equal "
            f"ones, are too few to judge by (at least {FEWEST_BLOCKS}, worth {FEWEST_EFFECTIVE:g})"
        )
    names = tuple(u.name for u in solved.regression.shared)
    values, std = solved.point.x[: solved.s], np.sqrt(np.diag(covariance))
    half = [intervals.t_quantile(d) * e for d, e in zip(degrees, std, strict=True)]
    own, own_std = _per_run(solved)
    return Solution(
        names=names,
        values=dict(zip(names, values.tolist(), strict=True)),
        std=dict(zip(names, std.tolist(), strict=True)),
        interval95={n: (float(v - h), float(v + h)) for n, v, h in zip(names, values, half, strict=True)},
        per_run=own,
        per_run_std=own_std,
        covariance=covariance,
        classical_covariance=classical,
        cost=solved.point.cost,
        residuals=residuals,
        unit=unit,
        n_units=len(units),
        effective_units=effective,
        degrees=dict(zip(names, degrees.tolist(), strict=True)),
        units=tuple(Unit(u.run, u.block, u.triangle, c) for u, c in zip(units, found.deletions, strict=True)),
        downweighted=tuple(downweighted),
        warnings=tuple(warnings),
        iterations=solved.minimum.iterations,
    )


def _per_run(solved: Solved) -> tuple[dict[str, Array], dict[str, Array]]:
    """Values and standard deviations of the runs' own unknowns, (runs,) each."""
    count = len(solved.regression.runs)
    values = solved.point.x[solved.s :].reshape(count, solved.m)
    std = np.sqrt(solved.variance * np.array([np.diag(solved.own_covariance(k)) for k in range(count)]))
    names = [u.name for u in solved.regression.own]
    return {n: values[:, i] for i, n in enumerate(names)}, {n: std[:, i] for i, n in enumerate(names)}


def _least(solved: Solved, effective: Array, count: int) -> float:
    """Effective units of the least favored unknown that is asked for and that only the data tell."""
    asked = [e for e, u in zip(effective, solved.regression.shared, strict=True) if not (u.nuisance or u.prior)]
    return float(min(asked, default=count))


def _enough_runs(solved: Solved) -> bool:
    if len(solved.regression.runs) < FEWEST_RUNS:
        return False
    told = np.sum((solved.reduced.runs[:, :, :-1] @ solved.covariance) ** 2, axis=1)
    return _least(solved, intervals.effective_number(told), len(told)) >= FEWEST_EFFECTIVE


def _with_priors(solved: Solved, kind: Kind, found: intervals.Spread) -> tuple[Array, Array]:
    """Covariance and degrees of freedom with what the priors' own uncertainty adds.

    The scatter of blocks cannot show it: a prior says the same to every block. Where the run is the unit, the runs'
    own priors are within it already. Satterthwaite: what priors state has no degrees of freedom to lose.
    """
    rows = list(prior_rows(solved.regression.shared, np.zeros(solved.s))[:, :-1])
    if kind == "block":
        own = [(i, u.prior[1]) for i, u in enumerate(solved.regression.own) if u.prior]
        rows += [follow[i] / std for follow in solved.follow for i, std in own]
    moved = np.array(rows).reshape(-1, solved.s) @ solved.covariance
    covariance = found.covariance + moved.T @ moved
    scatter, total = np.diag(found.covariance), np.diag(covariance)
    growth = total / np.maximum(scatter, 1e-300)
    degrees = np.where(growth < MOSTLY_STATED, found.degrees * np.minimum(growth, MOSTLY_STATED) ** 2, np.inf)
    return covariance, degrees


def _evidence(solved: Solved, unit: Unit, kind: Kind) -> Evidence:
    if kind == "run":
        return Evidence(unit.run, solved.reduced.runs[unit.run], np.zeros((0, 0)), np.zeros((0, solved.s)))
    return Evidence(unit.run, unit.triangle, solved.own[unit.run], solved.follow[unit.run])


def _units(solved: Solved, kind: Kind) -> tuple[list[Unit], tuple[Array, ...], list[Downweighted]]:
    """Second pass, at the solution: triangles per unit, residuals, outliers."""
    regression, s = solved.regression, solved.s
    units: list[Unit] = []
    residuals, downweighted = [], []
    counts = _blocks_of_runs(solved)
    for run, name in enumerate(regression.runs):
        rows = regression.rows(run, regression.local(solved.point.x, run))
        matrix = matrix_of(rows, s, solved.loss, solved.scale)
        if kind == "run":
            labels = np.zeros(len(matrix), dtype=np.int64)
        elif rows.block is not None:
            labels = np.unique(rows.block, return_inverse=True)[1].astype(np.int64)
        else:
            labels = _cut(solved, run, rows, matrix, counts[run])
        for label in range(int(labels.max(initial=-1)) + 1):
            units.append(Unit(run, label, fold(matrix[labels == label]), np.zeros(s)))
        residuals.append(rows.residual)
        downweighted += _outliers(solved, name, rows.residual)
    return units, tuple(residuals), downweighted


def _blocks_of_runs(solved: Solved) -> NDArray[np.int64]:
    """How many blocks each run is cut into: by its share of the information, one at least."""
    whole = solved.reduced.runs[:, :, :-1]
    told = np.sum((whole @ solved.covariance) * whole, axis=(1, 2))
    blocks = max(BLOCKS, PER_UNKNOWN * solved.s)
    quota = blocks * told / max(float(np.sum(told)), 1e-300)
    counts: NDArray[np.int64] = np.maximum(np.floor(quota), 1).astype(np.int64)
    missing = max(blocks - int(counts.sum()), 0)
    counts[np.argsort(counts - quota, kind="stable")[:missing]] += 1
    return counts


def _cut(solved: Solved, run: int, rows: Rows, matrix: Array, blocks: int) -> NDArray[np.int64]:
    """Blocks of equal information about the shared unknowns within one run, in the order of time."""
    m = solved.m
    total = matrix[:, m:-1] + matrix[:, :m] @ solved.follow[run]
    told = np.sum((total @ solved.covariance) * total, axis=1)
    order = np.argsort(rows.time, kind="stable") if rows.time is not None else np.arange(len(told))
    labels = np.empty(len(told), dtype=np.int64)
    labels[order] = equal_information_blocks(told[order], int(blocks))
    return labels


def _outliers(solved: Solved, run: str, residual: Array) -> list[Downweighted]:
    if solved.loss == "none":
        return []
    weight = weights(residual, solved.loss, solved.scale)
    at = np.flatnonzero(weight < OUTLIER)
    groups = np.split(at, np.flatnonzero(np.diff(at) > NEIGHBORS) + 1) if at.size else []
    return [Downweighted(run, int(g[0]), int(g[-1]), float(np.mean(weight[g]))) for g in groups]
