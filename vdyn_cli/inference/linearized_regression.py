"""Regressions as straight lines, and how the rows of a run are cut into blocks of evidence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.intervals import equal_information_blocks
from vdyn_cli.inference.qr_factors import Array, fold
from vdyn_cli.inference.regression import Regression, Rows, Unknown

BLOCKS = 24  # of all runs together where runs are few
FEWEST_ROWS = 6  # of a block, or its own pattern of noise weighs too much


def frozen(regression: Regression) -> Regression:
    """The regression as straight lines through its start, each run folded to a triangle for each of its blocks.

    For models that are dear to simulate and whose unknowns are known well beforehand: one pass over the logs, and every
    later fit costs next to nothing. Errors grow with the square of the steps. Known quantities range as far down as up:
    on a straight line nothing ends at zero, and how far off they are then is what a diagnosis is to see.
    """
    x = regression.start()
    runs = len(regression.runs)
    folded = []
    for k in range(runs):
        at = regression.local(x, k)
        rows = regression.rows(k, at)
        matrix = np.column_stack([rows.jacobian, rows.residual])
        cut = blocks_of(rows, matrix, blocks_within(rows, -(-BLOCKS // runs)))
        triangles = [fold(matrix[b]) for b in cut]
        whole = np.vstack(triangles)
        label = np.repeat(np.arange(len(cut), dtype=np.int64), [len(t) for t in triangles])
        count = np.array([len(b) for b in cut], dtype=np.int64)
        folded.append((at, Rows(whole[:, -1], whole[:, :-1], label, None, rows.plain, count, rows.plain_root)))

    def straight(run: int, theta: Array) -> Rows:
        at, rows = folded[run]
        step = theta - at
        plain = rows.plain
        if plain is not None:
            plain = plain[0] + plain[1] @ step, plain[1]
        return replace(rows, residual=rows.residual + rows.jacobian @ step, plain=plain)

    return replace(regression, unknowns=tuple(map(_as_far_down, regression.unknowns)), rows=straight, narrow=None)


def _as_far_down(u: Unknown) -> Unknown:
    return replace(u, lower=min(u.lower, 2.0 * u.start - u.upper)) if u.prior and u.nuisance else u


def blocks_within(rows: Rows, wanted: int) -> int:
    return max(1, min(wanted, rows.residual.size // FEWEST_ROWS))


def blocks_of(rows: Rows, matrix: Array, blocks: int) -> list[NDArray[np.int64]]:
    """Rows of each block, in the order of time, with equal information about all unknowns together."""
    if rows.block is not None and rows.folded is not None:
        return [np.flatnonzero(rows.block == b) for b in range(len(rows.folded))]
    order = np.argsort(rows.time, kind="stable") if rows.time is not None else np.arange(len(matrix))
    q = np.linalg.qr(scaled(matrix[:, :-1]))[0]
    # Half by information, half by count: no block may hold too few rows to show its noise.
    told = np.sum(q**2, axis=1)[order]
    told = told / max(float(told.sum()), 1e-300) + 1.0 / told.size
    label = equal_information_blocks(told, blocks)
    return [order[label == b] for b in range(int(label.max()) + 1)]


def scaled(columns: Array) -> Array:
    """Columns of length one; those that vanish are left out."""
    size = np.sqrt(np.sum(columns**2, axis=0))
    return np.asarray(columns[:, size > 0] / size[size > 0])
