"""What the extension gains on data that it has not seen, the choice of the cause repeated without them.

Each fold leaves one run out (or one block of time where runs are few), chooses again among the causes by the same rule,
refits to first order, and predicts what was left out. A run's own unknowns (a start speed) are taken from the run
itself, as anybody who predicts a run must. Where a step simulates with parameters as they are believed and from the
measured start, so do both predictions, before and after; of the fit they take the size of the cause.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.diagnosis.scatter import Doubted, doubted, scatter
from vdyn_cli.diagnosis.scores import scores
from vdyn_cli.diagnosis.sheet import Linear, Sheet, as_measured
from vdyn_cli.diagnosis.workbench import Fitted, Workbench
from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.inference.qr_factors import Array
from vdyn_cli.inference.regression import prior_rows

FEWEST_RUNS = 4  # that can be left out one by one; fewer are cut into blocks
FEWEST_DRIVES = 3  # of which nothing is fitted but the size of the cause
FEWEST_BLOCKS = 8
WORTH = 4  # folds that a model of the noise is worth
EXACT = 1e-3  # of the error: no simulation, and no law, is exact to less, whatever three drives agree on
CHOSEN = 2.0  # normal equivalent of evidence below which a fold chooses no further cause

Mask = NDArray[np.bool_]
Fold = tuple[int, Mask]  # the run that is left out (-1: a block), and its rows


@dataclass(frozen=True)
class Gain:
    """Root mean square of what is predicted wrongly, before and after.

    Parameters
    ----------
    plain : in the unit of the main channel; else in standard deviations of its noise.
    interval : 95 % of before - after on new logs of the same kind and number.
    share : of the explainable error (above the noise), of all channels together, that is gone.
    better : is the main channel, or are all channels together, predicted better for sure?
    worse : do refitted models predict them worse for sure?
    """

    before: float
    after: float
    plain: bool
    interval: tuple[float, float]
    share: float
    folds: int
    better: bool
    worse: bool


@dataclass(frozen=True)
class Missed:
    """Sums of squares of what is predicted wrongly: whitened, and of the main channel where it is known.

    Parameters
    ----------
    doubted : the main channel's errors, where nothing was fitted to the run and the step has a model of its noise.
    """

    squares: float
    rows: float
    plain: float
    plain_rows: int
    doubted: Doubted | None = None


def gain(bench: Workbench, base: Fitted, extended: Fitted, choose: Sequence[str], seen: Fitted) -> Gain | None:
    """Held-out gain of the extension, None where there are too few pieces to leave out.

    Parameters
    ----------
    choose : the causes among which every fold chooses again.
    seen : where it does: no cause in, on the lines on which the answer was found.
    """
    fewest = FEWEST_DRIVES if bench.believed else FEWEST_RUNS
    folds = _folds(base.sheet, fewest)
    if folds[0][0] < 0 and len(folds) < FEWEST_BLOCKS:
        return None

    def cut_alike(one: Fitted | None, other: Fitted) -> Fitted:
        return one if one is not None and len(_folds(one.sheet, fewest)) == len(folds) else other

    near, there = cut_alike(bench.near(extended), extended), cut_alike(seen, base)
    without = cut_alike(bench.simulated(extended), base)
    simulated: dict[tuple[str, ...], Fitted] = {(): without}
    before, after, fitted = [], [], []
    for k in range(len(folds)):
        chosen = extended.causes  # what has no slope at nothing cannot be chosen there
        if set(chosen) <= set(choose):
            chosen = _chosen(bench, there, k, fewest, choose, extended.causes)
        at = near if chosen == extended.causes else there
        first, fold = _folds(without.sheet, fewest)[k], _folds(at.sheet, fewest)[k]
        values = _values(at, fold, [*bench.base, *(n for c in chosen for n in bench.freed(c))])
        fitted.append((_missed(without, first, _values(without, first, bench.base)), _missed(at, fold, values)))
        if not bench.believed:
            continue
        values |= bench.believed
        if chosen not in simulated:
            simulated[chosen] = cut_alike(bench.simulated(extended, chosen, values), at)
        drives = simulated[chosen]
        before.append(_as_begun(without, first, bench.believed))
        after.append(_as_begun(drives, _folds(drives.sheet, fewest)[k], values))
    if not bench.believed:
        before, after = [b for b, _ in fitted], [a for _, a in fitted]
    return _summary(before, after, _worse(fitted))


def _folds(sheet: Sheet, fewest: int) -> list[Fold]:
    """What is left out in turn: every run, or every block where runs are few."""
    runs = np.unique(sheet.run[sheet.run >= 0])
    of_row = sheet.run[sheet.label]
    if runs.size >= fewest:
        return [(int(k), of_row == k) for k in runs]
    return [(-1, sheet.label == u) for u in np.flatnonzero(sheet.run >= 0)]


def rms_of(linear: Linear, fitted: bool = True) -> float:
    """Root mean square of the main channel's error as the runs are, their own unknowns fitted to them or not."""
    own = None if fitted else np.zeros(len(linear.regression.own))
    every = [_left_of_run(linear, k, {}, own) for k in range(len(linear.rows))]
    plain = every[0].plain_rows > 0
    squares = sum(m.plain if plain else m.squares for m in every)
    return float(np.sqrt(squares / sum(m.plain_rows if plain else m.rows for m in every)))


def _chosen(
    bench: Workbench, seen: Fitted, fold: int, fewest: int, choose: Sequence[str], answer: Sequence[str]
) -> tuple[str, ...]:
    """The answer that the fold would have given: cause after cause, the one that then explains most.

    A further one is looked for on lines through the fit with those before it, as it was in the whole: beside a cause
    that is large, lines through a model without it bend too much to show a small one.
    """
    at, found = seen, list[str]()
    for _ in answer:
        rest = _kept(at.sheet, ~_folds(at.sheet, fewest)[fold][1])
        fitted = [*bench.base, *(n for c in found for n in bench.freed(c))]
        scored = scores(rest, fitted, {n: bench.unknowns(n) for n in choose if n not in found})
        best = scored.strongest()
        if best is None or scored.evidence[best] < CHOSEN:
            break
        found.append(best)
        nearer = bench.fitted(found) if set(found) < set(answer) and not bench.case.straight else None
        if nearer is not None and len(_folds(nearer.sheet, fewest)) == len(_folds(at.sheet, fewest)):
            at = nearer
    return tuple(sorted(found))


def _kept(sheet: Sheet, kept: Mask) -> Sheet:
    """What is left of a sheet with some of its rows."""
    units, label = np.unique(sheet.label[kept], return_inverse=True)
    return Sheet(
        sheet.names,
        sheet.columns[kept],
        sheet.y[kept],
        label.astype(np.int64),
        sheet.run[units],
        sheet.counts[units],
        sheet.kind,
    )


def _values(at: Fitted, fold: Fold, names: Sequence[str]) -> dict[str, float]:
    """Shared unknowns as a fit to all other rows has them."""
    own = [n for n in at.sheet.names if "#" in n]
    step = _fitted(at.sheet.of([*names, *own]), at.sheet.y, ~fold[1])
    here = _here(at.linear)
    return {n: here[n] + move for n, move in zip(names, step.tolist(), strict=False)}


def _here(linear: Linear) -> dict[str, float]:
    return {u.name: x for u, x in zip(linear.regression.shared, linear.shared.tolist(), strict=True)}


def _steps(at: Fitted, values: Mapping[str, float]) -> dict[str, float]:
    here = _here(at.linear)
    return {n: value - here[n] for n, value in values.items()}


def _missed(at: Fitted, fold: Fold, values: Mapping[str, float]) -> Missed:
    """What a model with these values predicts wrongly in a run, or in a block, its own unknowns the best for it."""
    sheet, (run, rows) = at.sheet, fold
    step = _steps(at, values)
    if run >= 0:
        return _left_of_run(at.linear, run, step, None)
    left = sheet.y - sheet.of(list(step)) @ np.array(list(step.values()))
    mine = sheet.of([n for n in sheet.names if "#" in n])
    return _of_block(sheet, rows, left - mine @ _fitted(mine, left, ~rows))


def _as_begun(at: Fitted, fold: Fold, values: Mapping[str, float]) -> Missed:
    """What a model with these values predicts wrongly, every run begun as it was measured."""
    sheet, (run, rows) = at.sheet, fold
    step, begun = _steps(at, values), _begun(at.linear)
    if run >= 0:
        return _left_of_run(at.linear, run, step, begun[run])
    left = sheet.y - sheet.of(list(step)) @ np.array(list(step.values()))
    return _of_block(sheet, rows, left - sheet.of([n for n in sheet.names if "#" in n]) @ begun.ravel())


def _begun(linear: Linear) -> Array:
    """(runs, m), the step of every run's own unknowns back to where they are known to be without a fit."""
    starts = list(as_measured(linear.regression).values())
    return np.array(starts, dtype=float).reshape(len(starts), len(linear.rows)).T - linear.own


def _of_block(sheet: Sheet, rows: Mask, left: Array) -> Missed:
    return Missed(float(left[rows] @ left[rows]), float(np.sum(sheet.counts[np.unique(sheet.label[rows])])), 0.0, 0)


def _fitted(columns: Array, y: Array, kept: Mask) -> Array:
    """Least squares on the kept rows for columns of any scale."""
    size = np.sqrt(np.sum(columns**2, axis=0))
    size = np.where(size > 0, size, 1.0)
    return np.asarray(np.linalg.lstsq(columns[kept] / size, y[kept], rcond=1e-9)[0] / size)


def _left_of_run(linear: Linear, run: int, moved: Mapping[str, float], own: Array | None) -> Missed:
    """What is left of a run after a step of the shared unknowns and one of its own, the best where None is given."""
    rows, s = linear.rows[run], len(linear.regression.shared)
    step = np.array([moved.get(u.name, 0.0) for u in linear.regression.shared])
    left = rows.residual + rows.jacobian[:, :s] @ step
    mine = rows.jacobian[:, s:]
    begun = own is not None
    if own is None:
        known = prior_rows(linear.regression.own, linear.own[run])
        stacked, right = np.vstack([mine, known[:, :-1]]), np.concatenate([left, known[:, -1]])
        own = -np.linalg.lstsq(stacked, right, rcond=1e-9)[0] if mine.size else np.zeros(0)
    left = left + mine @ own
    plain = np.zeros(0)
    if rows.plain is not None:
        plain = rows.plain[0] + rows.plain[1][:, :s] @ step + rows.plain[1][:, s:] @ own
    count = left.size if rows.folded is None else int(rows.folded.sum())
    how_else = doubted(linear, run, plain) if begun else None
    return Missed(float(left @ left), float(count), float(plain @ plain), plain.size, how_else)


def _summary(before: Sequence[Missed], after: Sequence[Missed], worse: bool) -> Gain:
    """Means over folds, the interval from their scatter; it holds for as many new runs, which scatter as well."""
    plain = all(m.plain_rows for m in (*before, *after))
    doubts = [[m.doubted for m in them if m.doubted is not None] for them in (before, after)]
    modelled = scatter(*doubts) if plain and all(len(d) == len(before) for d in doubts) else None
    rms_b, rms_a, half = _fall(_sums(before, plain), _sums(after, plain), modelled)
    half = float(np.hypot(half, EXACT * rms_b))
    was, is_ = sum(m.squares for m in before), sum(m.squares for m in after)
    explainable = max(was - sum(m.rows for m in before), 1e-12)
    share = float(np.clip((was - is_) / explainable, 0.0, 1.0))
    interval = rms_b - rms_a - half, rms_b - rms_a + half
    was_all, is_all, half_all = _fall(_sums(before, False), _sums(after, False))
    better = interval[0] > 0.0 or was_all - is_all > half_all
    return Gain(rms_b, rms_a, plain, interval, share, len(before), better, worse)


def _worse(fitted: Sequence[tuple[Missed, Missed]]) -> bool:
    """Do all channels together fare worse for sure, both models with their parameters as fitted?

    With parameters as believed they may, and the cause be true: two errors that hid each other are one no longer.
    """
    first, then = (_sums([pair[k] for pair in fitted], False) for k in (0, 1))
    before, after, half = _fall(first, then)
    return before - after + half < 0


def _sums(missed: Sequence[Missed], plain: bool) -> Array:
    """(folds, 2), sums of squares and their numbers."""
    return np.array([(m.plain, m.plain_rows) if plain else (m.squares, m.rows) for m in missed])


def _fall(before: Array, after: Array, modelled: float | None = None) -> tuple[float, float, float]:
    """Root mean squares before and after, and half the interval of their difference, of sums and their numbers.

    Parameters
    ----------
    modelled : variance of the difference from day to day by a model of the noise: worth ``WORTH`` folds, for the few
        that there are may happen to be alike.
    """
    b, counts, a = before[:, 0], before[:, 1], after[:, 0]
    n, mean = len(b), float(counts.mean())
    rms_b, rms_a = float(np.sqrt(b.sum() / counts.sum())), float(np.sqrt(a.sum() / counts.sum()))
    # Influence of each fold on the difference of the roots.
    pull = (b - counts * rms_b**2) / (2 * rms_b * mean) - (a - counts * rms_a**2) / (2 * rms_a * mean)
    variance, freedom = float(np.var(pull, ddof=1)) / n, n - 1
    if modelled is not None:
        variance, freedom = (freedom * variance + WORTH * modelled) / (freedom + WORTH), freedom + WORTH
    return rms_b, rms_a, t_quantile(freedom) * float(np.sqrt(2.0 * variance))
