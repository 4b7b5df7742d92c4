"""The independent units at a minimum, and the solution with intervals from their scatter."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import intervals
from vdyn_cli.inference.intervals import UnitFactor, equal_information_blocks
from vdyn_cli.inference.normal_system import Solved
from vdyn_cli.inference.qr_factors import qr_factor
from vdyn_cli.inference.regression import Rows, augmented_matrix, prior_rows
from vdyn_cli.inference.solution import Solution, Unit
from vdyn_cli.quantities.arrays import Array

Kind = Literal["run", "block"]

FEWEST_RUNS = 6  # from which the run is the unit, if their information is even enough: t quantile 2.6 with 5 degrees
BLOCKS = 12  # blocks within runs otherwise: if there were more, the residual autocorrelation would couple them
PER_UNKNOWN = 3  # smallest number of blocks per shared unknown without a prior: with fewer the fit absorbs the scatter
FEWEST_BLOCKS = 8
FEWEST_EFFECTIVE = 4.0  # effective number of units below which their scatter is not used: 3 degrees of freedom
MOSTLY_PRIOR = 1e4  # variance over that of the data from which the prior alone sets the interval (1 % of the std)
LARGEST_PULL = 4.5  # standard deviations from a prior above which it is reported: 7e-6 by chance


def _contradicted_priors(solved: Solved) -> list[str]:
    """Sentences about given or usual values that the data contradict, without priors that the program estimated."""
    regression, x = solved.regression, solved.point.x
    every = regression.shared + regression.own * len(regression.runs)
    found = []
    for i, unknown in enumerate(every):
        if unknown.prior is not None and unknown.prior_stated:
            mean, std = unknown.prior
            off = (x[i] - mean) / std
            if abs(off) > LARGEST_PULL:
                value, prior = (f"{number:.4g} {unknown.unit}".strip() for number in (x[i], mean))
                what = f"{regression.label(i)} is estimated at {value}, {abs(off):.0f} standard deviations from "
                found.append(f"{what}{prior}, the given or usual value: correct that value, or state its '+-'")
    return found


def infer(solved: Solved, wanted: Literal["auto", "run", "block"]) -> Solution:
    """The solution, with intervals from the scatter of runs or blocks; with too few of them, from the noise model.

    Parameters
    ----------
    solved : the minimum.
    wanted : independent unit of the intervals; ``auto`` takes runs where they suffice, else blocks.
    """
    kind: Kind = ("run" if _enough_runs(solved) else "block") if wanted == "auto" else wanted
    units, residuals = _units(solved, kind)
    found = intervals.spread([_unit_factor(solved, u, kind) for u in units], solved.covariance)
    effective = _smallest_effective(solved, found.effective, len(units))
    many = len(units) >= FEWEST_BLOCKS and effective >= FEWEST_EFFECTIVE
    warnings = _contradicted_priors(solved)
    classical = solved.variance * solved.covariance
    if len(units) >= 2 and (kind == "run" or many or wanted == "block"):
        covariance, degrees = _with_priors(solved, kind, found)
        unit: Literal["run", "block", "model"] = kind
    else:
        covariance, degrees, unit = classical, np.full(solved.s, solved.degrees), "model"
        few = len(units) < FEWEST_BLOCKS
        lacking = f"{len(units)} independent units are too few (needed: {FEWEST_BLOCKS})"
        if not few:
            shown = np.floor(10.0 * effective) / 10.0  # 3.96 is less than 4
            lacking = f"the effective number of units, {shown:.1f}, is too small (needed: {FEWEST_EFFECTIVE:g})"
        warnings.append(f"the intervals are based on the noise model alone: {lacking}")
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
        units=tuple(Unit(u.run, u.block, u.factor, c) for u, c in zip(units, found.deletions, strict=True)),
        warnings=tuple(warnings),
    )


def _per_run(solved: Solved) -> tuple[dict[str, Array], dict[str, Array]]:
    """Values and standard deviations of the runs' own unknowns, (runs,) each."""
    count = len(solved.regression.runs)
    values = solved.point.x[solved.s :].reshape(count, solved.m)
    std = np.sqrt(solved.variance * np.array([np.diag(solved.own_covariance(k)) for k in range(count)]))
    names = [u.name for u in solved.regression.own]
    return {n: values[:, i] for i, n in enumerate(names)}, {n: std[:, i] for i, n in enumerate(names)}


def _smallest_effective(solved: Solved, effective: Array, count: int) -> float:
    """Smallest effective number of units over the requested unknowns; ``count`` if all have priors."""
    requested = [e for e, u in zip(effective, solved.regression.shared, strict=True) if not (u.nuisance or u.prior)]
    return float(min(requested, default=count))


def _enough_runs(solved: Solved) -> bool:
    independent = solved.regression.independent_runs
    if len(independent) < FEWEST_RUNS:
        return False
    parts = np.sum((solved.reduced.runs[:, :, :-1] @ solved.covariance) ** 2, axis=1)
    information = np.array([np.sum(parts[list(run)], axis=0) for run in independent])
    return _smallest_effective(solved, intervals.effective_number(information), len(information)) >= FEWEST_EFFECTIVE


def _with_priors(solved: Solved, kind: Kind, found: intervals.Spread) -> tuple[Array, Array]:
    """Covariance (s, s) and degrees of freedom (s,) with the uncertainty of the priors added.

    The scatter of blocks does not contain it, because a prior is common to all blocks. Where the run is the unit, the
    scatter contains the runs' own priors. Satterthwaite's degrees of freedom, infinite for the part of stated priors.
    """
    rows = list(prior_rows(solved.regression.shared, np.zeros(solved.s))[:, :-1])
    few = min((u.prior_degrees for u in solved.regression.shared if u.prior), default=np.inf)
    estimated = [u.prior_degrees < np.inf for u in solved.regression.shared if u.prior]
    if kind == "block":
        own = [(i, u.prior[1]) for i, u in enumerate(solved.regression.own) if u.prior]
        rows += [response[i] / std for response in solved.own_response for i, std in own]
    moved = np.array(rows).reshape(-1, solved.s) @ solved.covariance
    covariance = found.covariance + moved.T @ moved
    scatter, total = np.diag(found.covariance), np.diag(covariance)
    growth = total / np.maximum(scatter, 1e-300)
    degrees = np.where(growth < MOSTLY_PRIOR, found.degrees * np.minimum(growth, MOSTLY_PRIOR) ** 2, np.inf)
    if any(estimated):
        share = np.sum(moved[: len(estimated)][estimated] ** 2, axis=0) / np.maximum(total, 1e-300)
        inverse = 1.0 / degrees + share**2 / few
        degrees = np.divide(1.0, inverse, out=np.full_like(inverse, np.inf), where=inverse > 0.0)
    return covariance, degrees


def _unit_factor(solved: Solved, unit: Unit, kind: Kind) -> UnitFactor:
    if kind == "run":
        parts = next(parts for parts in solved.regression.independent_runs if unit.run in parts)
        rows = np.vstack([solved.reduced.runs[part] for part in parts])
        return UnitFactor(unit.run, rows, np.zeros((0, 0)), np.zeros((0, solved.s)))
    return UnitFactor(unit.run, unit.factor, solved.own[unit.run], solved.own_response[unit.run])


def _units(solved: Solved, kind: Kind) -> tuple[list[Unit], tuple[Array, ...]]:
    """Second pass over the runs, at the solution: QR factor of each unit, and residuals.

    Where the run is the unit, its parts are one unit, because they have the same wind and tires.
    """
    regression, s = solved.regression, solved.s
    units: list[Unit] = []
    residuals = []
    counts = _blocks_of_runs(solved)
    for run in range(len(regression.runs)):
        rows = regression.rows(run, regression.local(solved.point.x, run))
        matrix = augmented_matrix(rows, s)
        residuals.append(rows.residual)
        if kind == "run":
            labels = np.zeros(len(matrix), dtype=np.int64)
        elif rows.block is not None:
            labels = np.unique(rows.block, return_inverse=True)[1].astype(np.int64)
        else:
            labels = _cut(solved, run, rows, matrix, counts[run])
        for label in range(int(labels.max(initial=-1)) + 1):
            units.append(Unit(run, label, qr_factor(matrix[labels == label]), np.zeros(s)))
    if kind == "run":
        factors = (np.vstack([units[part].factor for part in parts]) for parts in regression.independent_runs)
        units = [
            Unit(parts[0], 0, f, np.zeros(s)) for parts, f in zip(regression.independent_runs, factors, strict=True)
        ]
    return units, tuple(residuals)


def _blocks_of_runs(solved: Solved) -> NDArray[np.int64]:
    """Number of blocks of each run, in proportion to its information; at least one."""
    whole = solved.reduced.runs[:, :, :-1]
    information = np.sum((whole @ solved.covariance) * whole, axis=(1, 2))
    free = sum(u.prior is None for u in solved.regression.shared)
    blocks = max(BLOCKS, PER_UNKNOWN * free)
    quota = blocks * information / max(float(np.sum(information)), 1e-300)
    counts: NDArray[np.int64] = np.maximum(np.floor(quota), 1).astype(np.int64)
    missing = max(blocks - int(counts.sum()), 0)
    counts[np.argsort(counts - quota, kind="stable")[:missing]] += 1
    return counts


def _cut(solved: Solved, run: int, rows: Rows, matrix: Array, blocks: int) -> NDArray[np.int64]:
    """Blocks of equal information about the shared unknowns within one run, in the order of time."""
    m = solved.m
    total = matrix[:, m:-1] + matrix[:, :m] @ solved.own_response[run]
    information = np.sum((total @ solved.covariance) * total, axis=1)
    order = np.argsort(rows.time, kind="stable") if rows.time is not None else np.arange(len(information))
    labels = np.empty(len(information), dtype=np.int64)
    labels[order] = equal_information_blocks(information[order], int(blocks))
    return labels
