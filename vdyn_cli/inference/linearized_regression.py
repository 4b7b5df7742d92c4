"""Regressions linearized once at their start values, and the blocks into which the rows of a run are divided."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.intervals import equal_information_blocks
from vdyn_cli.inference.qr_factors import orthonormal, qr_factor
from vdyn_cli.inference.regression import Regression, Rows, Unknown
from vdyn_cli.quantities.arrays import Array

BLOCKS = 24  # of all runs together where runs are few: 2^24 sign patterns suffice for every significance level in use
FEWEST_ROWS = 6  # per block: with fewer, a block's noise pattern dominates its score
# Per block for rows that are far apart, as in tables of split times: one false alarm at 5 % in 24 clean tables of 60
# and 52 levels, headwind of 2 m/s found in 5 of 5, slope of 0.6 % in 4 of 5; with blocks of 6 none can be diagnosed.
FEWEST_APART = 3


def linearized(regression: Regression) -> Regression:
    """The regression linearized at its start, each run reduced to one QR factor per block.

    r(theta) = r0 + J (theta - theta0), with r0 and J the whitened residual and its derivatives at the start theta0

    For models that are expensive to simulate and whose unknowns have narrow priors: one pass over the logs, and every
    later fit is cheap. The error grows with the square of the steps. Nuisance parameters with a prior lose their
    bounds: the prior constrains them, and a diagnosis tests how far they move.

    Raises
    ------
    ArithmeticError, ResultError : as ``regression.rows`` at the start.
    """
    x = regression.start()
    runs = len(regression.runs)
    reduced = []
    for k in range(runs):
        at = regression.local(x, k)
        rows = regression.rows(k, at)
        matrix = np.column_stack([rows.jacobian, rows.residual])
        cut = blocks_of(rows, matrix, blocks_within(rows, -(-BLOCKS // runs)))
        factors = [qr_factor(matrix[b]) for b in cut]
        whole = np.vstack(factors)
        label = np.repeat(np.arange(len(cut), dtype=np.int64), [len(t) for t in factors])
        count = np.array([len(b) for b in cut], dtype=np.int64)
        reduced.append((at, Rows(whole[:, -1], whole[:, :-1], label, None, rows.plain, count, rows.plain_root)))

    def at_point(run: int, theta: Array) -> Rows:
        at, rows = reduced[run]
        step = theta - at
        plain = rows.plain
        if plain is not None:
            plain = plain[0] + plain[1] @ step, plain[1]
        return replace(rows, residual=rows.residual + rows.jacobian @ step, plain=plain)

    return replace(regression, unknowns=tuple(map(_without_bounds, regression.unknowns)), rows=at_point, narrow=None)


def _without_bounds(u: Unknown) -> Unknown:
    return replace(u, lower=-np.inf, upper=np.inf) if u.prior and u.nuisance else u


def blocks_within(rows: Rows, wanted: int) -> int:
    """Number of blocks of a run: ``wanted``, or fewer to keep FEWEST_ROWS rows in each (FEWEST_APART if ``apart``)."""
    return max(1, min(wanted, rows.residual.size // (FEWEST_APART if rows.apart else FEWEST_ROWS)))


def blocks_of(rows: Rows, matrix: Array, blocks: int) -> list[NDArray[np.int64]]:
    """Row indices of each block, ordered by time, with equal information about all unknowns together.

    Parameters
    ----------
    rows : of one run; their own blocks are used where they are already reduced to QR factors.
    matrix : (n, k + 1) whitened [sensitivities | residual]. blocks : number of blocks.
    """
    if rows.block is not None and rows.block_counts is not None:
        return [np.flatnonzero(rows.block == b) for b in range(len(rows.block_counts))]
    order = np.argsort(rows.time, kind="stable") if rows.time is not None else np.arange(len(matrix))
    # Unknowns with the same sensitivity count once: beside the first, the others have a direction of mere rounding.
    q = orthonormal(matrix[:, :-1])
    # Half by information, half by count, so that each block holds enough rows to show its noise.
    information = np.sum(q**2, axis=1)[order]
    information = information / max(float(information.sum()), 1e-300) + 1.0 / information.size
    label = equal_information_blocks(information, blocks)
    return [order[label == b] for b in range(int(label.max()) + 1)]
