"""Runs that are outliers among the others: a dragging brake, a passing truck, an engaged gear, an added roof box.

Two tests use externally studentized residuals: of a run's force, and of its influence on the parameters. The third
tests for a step of the force from one run to the next.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.coastdown.fit.road_load_fit import MAIN, RoadLoadFit
from vdyn_cli.steps.coastdown.fit.run_change import WARMING
from vdyn_cli.steps.step_policy import STEP_POLICY

INSPECT = "inspect this run; remove it if traffic, a brake or a gust disturbed it"  # the remedy
CHANGED_PAIR = (
    "check what differed in these two runs (load, roof box, windows, tires, rain); if something did, repeat them"
)


@dataclass(frozen=True)
class OutlyingRun:
    """Index of the run, its excess force over the prediction from the others (N), and its p value."""

    run: int
    force: float
    p_value: float


def outlying_run(force: Array, heading: Array, level: float = STEP_POLICY.outlier_level) -> OutlyingRun | None:
    """The run with the largest externally studentized residual, if it is significant.

    The other runs predict each run from a mean, the direction (slope, wind) and the order (warming tires); its
    deviation over the standard error of that prediction is Student's t. The largest of n is tested at level/n
    (Bonferroni).

    Parameters
    ----------
    force : (n,) N, of each run beyond the common road load. heading : (n,) +1 out, -1 back.
    level : probability of naming a run on a day without an outlying one.

    Source: Cook and Weisberg, Residuals and Influence in Regression (1982), 2.2.2.
    """
    from scipy.special import stdtr

    n = force.size
    order = np.arange(n) - (n - 1) / 2
    rows = np.column_stack([np.ones(n), *([heading] if np.ptp(heading) > 0 else []), order])
    left = n - np.linalg.matrix_rank(rows) - 1
    if left < STEP_POLICY.outlier_degrees:
        return None
    hat = rows @ np.linalg.pinv(rows)
    residual, free = force - hat @ force, 1.0 - np.diag(hat)
    total = float(residual @ residual)
    if total <= 0:
        return None
    spread = np.sqrt(np.maximum(total - residual**2 / free, 1e-12 * total) / left)
    far = np.abs(residual) / np.sqrt(free) / spread
    worst = int(np.argmax(far))
    p_value = min(1.0, n * 2.0 * float(stdtr(left, -far[worst])))
    outlying = p_value < level
    return OutlyingRun(worst, float(residual[worst] / free[worst]), p_value) if outlying else None


def resistance_step(force: Array, heading: Array, tests: int = 1) -> OutlyingRun | None:
    """The run from which on the force is another one than in the runs before it, if that is significant.

    A mean, the direction and a step before run k are fitted, with at least two runs on either side; the largest t of
    a step over all k is tested at ``outlier_level`` (Bonferroni). None where a gradual change over the order fits
    about as well: a linear trend (cooling, rising wind), or the exponential approach of warming tires. Since tires
    warm up on every day, a downward step must also be significant beside each of these (``step_beside_warming``).

    Parameters
    ----------
    force : (n,) N, of each run beyond the common road load. heading : (n,) +1 out, -1 back.
    tests : number of forces, such as those at all and at high speeds, that are tested on one day (Bonferroni).
    """
    from scipy.special import stdtr

    n = force.size
    base = np.column_stack([np.ones(n), *([heading] if np.ptp(heading) > 0 else [])])
    left = n - base.shape[1] - 1
    if left < STEP_POLICY.outlier_degrees:
        return None
    order = np.arange(n, dtype=np.float64)
    changes = (order, *(np.exp(-order / k) for k in WARMING))
    gradual = min(_added(base, one, force)[0] for one in changes)
    steps = {k: _added(base, (np.arange(n) >= k).astype(np.float64), force) for k in range(2, n - 1)}
    first = min(steps, key=lambda k: steps[k][0])
    squares, size, leverage = steps[first]
    if gradual < STEP_POLICY.step_ratio * squares:
        return None
    std = np.sqrt(squares / left / leverage)
    p_value = min(1.0, 2.0 * tests * len(steps) * float(stdtr(left, -abs(size) / std))) if std > 0.0 else 0.0
    if size < 0.0 and left > 1:
        downward = (order >= first).astype(np.float64)
        beside = [_added(np.column_stack([base, one]), downward, force) for one in changes]
        t = max(step / np.sqrt(rest / (left - 1) / own) for rest, step, own in beside)
        if float(stdtr(left - 1, t)) > 0.5 * STEP_POLICY.step_beside_warming:
            return None
    return OutlyingRun(first, size, p_value) if p_value < STEP_POLICY.outlier_level else None


def outlying_pair(force: Array, heading: Array, tests: int = 1) -> OutlyingRun | None:
    """The first of two successive runs that differ by the same force from the runs before and after, if significant.

    An added and removed roof box, or rain, acts on a run out and the run back; two such runs hide each other from the
    test of one run. A mean, the direction, the order and the pair are fitted, for each pair but the first and the last
    (a step); the largest t is tested at ``outlier_level`` (Bonferroni).

    Parameters
    ----------
    force : (n,) N, of each run, in the order of their starts. heading : (n,) +1 out, -1 back.
    tests : number of forces that are tested on one day (Bonferroni).
    """
    from scipy.special import stdtr

    n = force.size
    order = np.arange(n, dtype=np.float64)
    base = np.column_stack([np.ones(n), *([heading] if np.ptp(heading) > 0 else []), order])
    left = n - base.shape[1] - 1
    if left < STEP_POLICY.outlier_degrees or np.linalg.matrix_rank(base) < base.shape[1]:
        return None
    pairs = {k: _added(base, np.isin(order, (k, k + 1)).astype(np.float64), force) for k in range(1, n - 2)}
    first = min(pairs, key=lambda k: pairs[k][0])
    squares, size, leverage = pairs[first]
    std = np.sqrt(squares / left / leverage)
    p_value = min(1.0, 2.0 * tests * len(pairs) * float(stdtr(left, -abs(size) / std))) if std > 0.0 else 0.0
    return OutlyingRun(first, size, p_value) if p_value < STEP_POLICY.outlier_level else None


def _added(base: Array, column: Array, force: Array) -> tuple[float, float, float]:
    """Residual sum of squares of base and column, the column's coefficient, and its squares orthogonal to the base."""
    own = column - base @ (np.linalg.pinv(base) @ column)
    rest = force - base @ (np.linalg.pinv(base) @ force)
    leverage = float(own @ own)
    size = float(own @ rest) / leverage
    return float(rest @ rest) - size**2 * leverage, size, leverage


def influential_runs(fit: RoadLoadFit, level: float) -> dict[str, tuple[str, ...]]:
    """The published unknowns that each run shifts significantly, by run.

    With d_b the changes by the run's n_k units and s the scatter of the others' n - n_k about their mean, the shift
    sum d_b has the standard deviation s sqrt(n_k n / (n - n_k)): a studentized residual, Student's t with n - n_k - 1
    degrees of freedom.

    Parameters
    ----------
    level : probability that any run of a campaign without outliers is named, over all runs and unknowns (Bonferroni).
    """
    solution, runs = fit.solution, fit.campaign.runs
    shared = [(i, n) for i, n in enumerate(solution.names) if n in MAIN]
    found: dict[str, tuple[str, ...]] = {}
    for k, run in enumerate(runs):
        mine = np.array([u.change for u in solution.units if u.run == k])
        rest = np.array([u.change for u in solution.units if u.run != k])
        if len(mine) == 0 or len(rest) < 2:
            continue
        count = len(mine) + len(rest)
        std = rest.std(axis=0, ddof=1) * np.sqrt(len(mine) * count / len(rest))
        limit = t_quantile(len(rest) - 1, 1.0 - 0.5 * level / (len(runs) * max(len(shared), 1))) * std
        found[run.name] = tuple(n for i, n in shared if abs(mine[:, i].sum()) > limit[i])
    return found
