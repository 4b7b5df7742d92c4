"""Runs that are outliers among the others: a dragging brake, a passing truck, an engaged gear, an added roof box.

Two tests use externally studentized residuals: of a run's force, and of its influence on the parameters. The third
tests for a step of the force from one run to the next.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr

from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.quantities.arrays import Array, Mask
from vdyn_cli.steps.coastdown.fit.road_load_fit import MAIN, RoadLoadFit
from vdyn_cli.steps.coastdown.fit.run_change import WARMING
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

ROUNDING = 1e-12  # share of a sum of squares that counts as zero


@dataclass(frozen=True)
class OutlyingRun:
    """Index of the run, its excess force over the prediction from the others (N), and its p value."""

    run: int
    force: float
    p_value: float


def outlying_run(
    force: Array, heading: Array, level: float = COASTDOWN_POLICY.outlier_level, tests: int = 1
) -> OutlyingRun | None:
    """The run with the largest externally studentized residual, if it is significant.

    The other runs predict each run from a mean, the direction (slope, wind) and the order (warming tires); its
    deviation over the standard error of that prediction is Student's t. The largest of n is tested at level/n
    (Bonferroni).

    Parameters
    ----------
    force : (n,) N, of each run beyond the common road load. heading : (n,) +1 out, -1 back.
    level : probability of naming a run on a day without an outlying one. tests : number of forces that are tested on
        one day (Bonferroni).

    Source: Cook and Weisberg, Residuals and Influence in Regression (1982), 2.2.2.
    """
    order = np.arange(force.size, dtype=np.float64)
    found = _largest(_base(heading, order), {k: order == k for k in range(force.size)}, force, tests)
    return found[0] if found is not None and found[0].p_value < level else None


def excess_of_run(force: Array, heading: Array, run: int) -> float:
    """The excess of a run's force over the prediction of ``outlying_run`` from the others, N."""
    order = np.arange(force.size, dtype=np.float64)
    return _added(_base(heading, order), order == run, force)[1]


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
    order, base = np.arange(force.size, dtype=np.float64), _base(heading)
    found = _largest(base, {k: order >= k for k in range(2, force.size - 1)}, force, tests)
    if found is None or found[0].p_value >= COASTDOWN_POLICY.outlier_level:
        return None
    step, squares = found
    changes = (order, *(np.exp(-order / k) for k in WARMING))
    if min(_added(base, one, force)[0] for one in changes) < COASTDOWN_POLICY.step_ratio * squares:
        return None
    left = force.size - base.shape[1] - 2
    if step.force < 0.0:
        beside = [_added(np.column_stack([base, one]), order >= step.run, force) for one in changes]
        t = max(size / np.sqrt(rest / left / own) for rest, size, own in beside)
        if float(stdtr(left, t)) > 0.5 * COASTDOWN_POLICY.step_beside_warming:
            return None
    return step


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
    order = np.arange(force.size, dtype=np.float64)
    pairs = {k: np.isin(order, (k, k + 1)) for k in range(1, force.size - 2)}
    found = _largest(_base(heading, order), pairs, force, tests)
    return found[0] if found is not None and found[0].p_value < COASTDOWN_POLICY.outlier_level else None


def _base(heading: Array, *others: Array) -> Array:
    """Columns (n, c) of what may change from run to run: a mean, the direction where both are driven, and others."""
    return np.column_stack([np.ones(heading.size), *([heading] if np.ptp(heading) > 0 else []), *others])


def _largest(
    base: Array, changes: Mapping[int, Mask], force: Array, tests: int = 1
) -> tuple[OutlyingRun, float] | None:
    """The most significant change of the force beside the base, and its residual sum of squares, N^2.

    None with fewer than ``outlier_degrees`` degrees of freedom, and where the base leaves no residual.

    Parameters
    ----------
    changes : by the index of a run, the runs (n,) on which it acts. tests : number of such searches (Bonferroni).
    """
    left = force.size - base.shape[1] - 1
    if left < COASTDOWN_POLICY.outlier_degrees:
        return None
    fits = {k: _added(base, runs, force) for k, runs in changes.items()}
    first = min(fits, key=lambda k: fits[k][0])
    squares, size, leverage = fits[first]
    if size == 0.0:
        return None
    far = abs(size) / np.sqrt(squares / left / leverage)
    return OutlyingRun(first, size, min(1.0, 2.0 * tests * len(changes) * float(stdtr(left, -far)))), squares


def _added(base: Array, column: Array | Mask, force: Array) -> tuple[float, float, float]:
    """Residual sum of squares of base and column, the column's coefficient, and its squares orthogonal to the base.

    The coefficient is zero where the base contains the column, and where it leaves no residual.
    """
    own, rest = (one - base @ (np.linalg.pinv(base) @ one) for one in (column, force))
    leverage, total = float(own @ own), float(rest @ rest)
    if leverage < ROUNDING or total <= 0.0:
        return total, 0.0, 1.0
    size = float(own @ rest) / leverage
    return max(total - size**2 * leverage, ROUNDING * total), size, leverage


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
