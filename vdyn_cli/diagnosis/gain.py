"""What the extension gains on runs that it has not seen, the choice of the cause repeated without them.

Each fold leaves one run out (or one block of time where runs are few), chooses again among the causes by the same rule,
refits, and predicts what was left out. Its own unknowns (a start speed) are taken from the run itself, as anybody who
predicts a run must.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.diagnosis.scores import scores
from vdyn_cli.diagnosis.sheet import Sheet
from vdyn_cli.diagnosis.workbench import Fitted, Workbench
from vdyn_cli.fit.intervals import t_quantile
from vdyn_cli.fit.triangles import Array

FEWEST_FOLDS = 4  # runs; fewer are cut into blocks


@dataclass(frozen=True)
class Gain:
    """Root mean square of what is predicted wrongly, before and after; ``share`` is that of the explainable error.

    Parameters
    ----------
    interval : 95 % of before - after on new logs of the same kind and number.
    """

    before: float
    after: float
    interval: tuple[float, float]
    share: float
    folds: int


def gain(bench: Workbench, base: Fitted, extended: Fitted, choose: Sequence[str]) -> Gain | None:
    """Held-out gain of the extension, None where there are too few pieces to leave out.

    Parameters
    ----------
    choose : the causes among which every fold chooses again.
    """
    folds = _folds(base.sheet)
    if len(folds) < FEWEST_FOLDS:
        return None
    before, after, counts = [], [], []
    for rows in folds:
        chosen = _chosen(bench, base.sheet, rows, choose, extended.causes)
        before.append(_missed(base.sheet, rows, bench.base))
        unknowns = [n for c in chosen for n in bench.unknowns(c)]
        at = extended if chosen == extended.causes else base
        after.append(_missed(at.sheet, rows, [*bench.base, *unknowns]))
        counts.append(_weight(base.sheet, rows))
    return _summary(np.array(before), np.array(after), np.array(counts))


def _folds(sheet: Sheet) -> list[Array]:
    """Row masks of what is left out in turn."""
    by_run = sheet.run[sheet.label]
    runs = np.unique(by_run[by_run >= 0])
    if runs.size >= FEWEST_FOLDS:
        return [by_run == k for k in runs]
    return [sheet.label == u for u in np.flatnonzero(sheet.run >= 0)]


def _without(sheet: Sheet, rows: Array) -> Sheet:
    kept = ~rows
    units, label = np.unique(sheet.label[kept], return_inverse=True)
    label = label.astype(np.int64)
    return Sheet(
        sheet.names, sheet.columns[kept], sheet.y[kept], label, sheet.run[units], sheet.counts[units], sheet.kind
    )


def _chosen(
    bench: Workbench, sheet: Sheet, rows: Array, choose: Sequence[str], named: tuple[str, ...]
) -> tuple[str, ...]:
    """The answer that the fold would have given: the set of as many causes that leaves least, or none."""
    rest = _without(sheet, rows)
    fitted = list(bench.base)
    found: tuple[str, ...] = ()
    for _ in named:
        candidates = {n: bench.unknowns(n) for n in choose if n not in found}
        seen = scores(rest, fitted, candidates)
        best = seen.strongest()
        if best is None or seen.evidence[best] < 2.0:
            break
        found = (*found, best)
        fitted += bench.unknowns(best)
    return tuple(sorted(found))


def _missed(sheet: Sheet, rows: Array, fitted: Sequence[str]) -> float:
    """Sum of squares of what a fit to the other rows predicts wrongly in these."""
    own = [n for n in sheet.names if "#" in n]
    names = [*fitted, *own]
    columns, size = sheet.of(names), None
    size = np.sqrt(np.sum(columns**2, axis=0))
    columns = columns / np.where(size > 0, size, 1.0)
    kept = ~rows
    values = np.linalg.lstsq(columns[kept], sheet.y[kept], rcond=1e-9)[0]
    left = sheet.y[rows] - columns[rows] @ values
    mine = [i for i, n in enumerate(names) if "#" in n and not np.any(columns[kept, i]) and np.any(columns[rows, i])]
    if mine:
        basis = np.linalg.qr(columns[np.ix_(rows, mine)])[0]
        left = left - basis @ (basis.T @ left)
    return float(left @ left)


def _weight(sheet: Sheet, rows: Array) -> float:
    """How many rows there were before they were compressed."""
    return float(np.sum(sheet.counts[np.unique(sheet.label[rows])]))


def _summary(before: Array, after: Array, counts: Array) -> Gain:
    """Means over folds, the interval from their scatter; it holds for as many new runs, which scatter as well."""
    n, total = len(before), counts.sum()
    rms_before, rms_after = np.sqrt(before.sum() / total), np.sqrt(after.sum() / total)
    # Influence of each fold on the difference of the roots.
    mean = counts.mean()
    pull = (before - counts * rms_before**2) / (2 * rms_before * mean) - (after - counts * rms_after**2) / (
        2 * rms_after * mean
    )
    spread = np.sqrt(2.0) * float(np.std(pull, ddof=1)) / np.sqrt(n)
    half = t_quantile(n - 1) * spread
    difference = float(rms_before - rms_after)
    explainable = max(float(before.sum() - total), 1e-12)
    share = float(np.clip((before.sum() - after.sum()) / explainable, 0.0, 1.0))
    return Gain(float(rms_before), float(rms_after), (difference - half, difference + half), share, n)
