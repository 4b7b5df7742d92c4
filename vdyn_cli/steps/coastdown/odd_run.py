"""One run that is not like the others: a brake that held, a lorry that passed, a gear that was in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CERTAIN = 0.01  # chance that a day without an odd run shows one
FREEDOM = 3  # degrees of freedom that the others must have left


@dataclass(frozen=True)
class Odd:
    """Which run (its index), by how much it resisted more than the others let expect (N), and the chance of that."""

    run: int
    force: float
    chance: float


def odd_run(force: Array, heading: Array) -> Odd | None:
    """The run farthest from a line through the others, if it is too far for chance.

    Each run is predicted by the others, from a mean, the direction and the order (slope, wind and warming tires make
    these); its distance over the standard error of that is Student's t, and the largest of n is held against
    ``CERTAIN``/n (Bonferroni).

    Parameters
    ----------
    force : (n,) N, by which each run resisted more than the common road load. heading : (n,) +1 out, -1 back.

    Source: Cook and Weisberg, Residuals and Influence in Regression (1982), 2.2.2.
    """
    from scipy.stats import t as student

    n = force.size
    order = np.arange(n) - (n - 1) / 2
    rows = np.column_stack([np.ones(n), *([heading] if np.ptp(heading) > 0 else []), order])
    left = n - np.linalg.matrix_rank(rows) - 1
    if left < FREEDOM:
        return None
    hat = rows @ np.linalg.pinv(rows)
    residual, free = force - hat @ force, 1.0 - np.diag(hat)
    total = float(residual @ residual)
    if total <= 0:
        return None
    spread = np.sqrt(np.maximum(total - residual**2 / free, 1e-12 * total) / left)
    far = np.abs(residual) / np.sqrt(free) / spread
    worst = int(np.argmax(far))
    chance = min(1.0, n * 2.0 * float(student.sf(far[worst], left)))
    return Odd(worst, float(residual[worst] / free[worst]), chance) if chance < CERTAIN else None
