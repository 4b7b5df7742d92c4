"""Decimation of lines and point sets to the resolution of a page, which preserves peaks and gaps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from vdyn_cli.quantities.arrays import Array


def finite(values: Array) -> Array:
    """The values of any shape as a flat array (n,) of doubles, with infinities replaced by NaN."""
    array = np.asarray(values, dtype=np.float64).ravel()
    return np.where(np.isfinite(array), array, np.nan)


def connected(x: Array, y: Array, jump: float = 8.0) -> tuple[Array, Array]:
    """The finite samples (n,), with a NaN inserted where x steps by more than ``jump`` times its median step.

    A slow channel in a fast log has NaN between all its samples; these are not gaps.
    """
    known = np.isfinite(x) & np.isfinite(y)
    x, y = x[known], y[known]
    if x.size < 3:
        return x, y
    steps = np.abs(np.diff(x))
    usual = float(np.median(steps[:: 1 + steps.size // 20_000]))
    holes = np.flatnonzero(steps > jump * usual) + 1 if usual > 0 else np.empty(0, np.intp)
    if not holes.size:
        return x, y
    return np.insert(x, holes, np.nan), np.insert(y, holes, np.nan)


def envelope(x: Array, y: Array, columns: int) -> tuple[Array, Array]:
    """Minimum and maximum of each of ``columns`` blocks of x, y (n,), in order; unchanged up to 4 samples per column.

    On ``columns`` px the line through the result looks like the line through all samples. A block that contains a gap
    (NaN) ends with a gap, so that it remains visible.
    """
    n = min(x.size, y.size)
    if n <= 4 * columns:
        return x[:n], y[:n]
    block = -(-n // columns)
    rows = -(-n // block)
    pad = rows * block - n
    ys = np.concatenate([y[:n], np.full(pad, np.nan)]).reshape(rows, block)
    xs = np.concatenate([x[:n], np.full(pad, np.nan)]).reshape(rows, block)
    gap = np.isnan(ys) | np.isnan(xs)
    lowest = np.where(gap, np.inf, ys).argmin(axis=1)
    highest = np.where(gap, -np.inf, ys).argmax(axis=1)
    order = np.sort(np.stack([lowest, highest], axis=1), axis=1)
    row = np.arange(rows)[:, None]
    gap[-1, block - pad :] = False  # padding, not a gap of the data
    breaks = gap.any(axis=1)
    out_x = np.concatenate([xs[row, order], xs[row, order[:, 1:]]], axis=1)
    out_y = np.concatenate([ys[row, order], np.full((rows, 1), np.nan)], axis=1)
    keep = np.ones((rows, 3), dtype=bool)
    keep[:, 2] = breaks
    return out_x[keep], out_y[keep]


def cloud(x: Array, y: Array, cells: tuple[int, int], most: int) -> NDArray[np.intp]:
    """Indices of the points x, y (n,) to draw: all finite ones, or, of more than ``most``, one per cell of a grid.

    Parameters
    ----------
    cells : number of cells in x and in y. most : largest number of indices.
    """
    index = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if index.size <= most:
        return index
    cell = _cells(x[index], cells[0]) * cells[1] + _cells(y[index], cells[1])
    _, first = np.unique(cell, return_index=True)
    chosen: NDArray[np.intp] = index[np.sort(first)]
    return chosen[:: -(-chosen.size // most)]


def _cells(values: Array, number: int) -> Array:
    """The index of each value's cell among ``number`` equal cells."""
    low, high = float(values.min()), float(values.max())
    return np.floor(np.minimum((values - low) / ((high - low) or 1.0) * number, number - 1))


def means(position: Array, values: Array, edges: Array, least: int) -> Array:
    """Mean (n,) of the values between successive edges, NaN where there are fewer than ``least``.

    Parameters
    ----------
    position, values : (m,), NaN allowed. edges : (n + 1,), increasing, in the unit of position.
    """
    known = np.isfinite(position) & np.isfinite(values)
    cells = edges.size - 1
    cell = np.searchsorted(edges, position[known], side="right") - 1
    cell = np.where(position[known] == edges[-1], cells - 1, cell)
    inside = (cell >= 0) & (cell < cells)
    number = np.bincount(cell[inside], minlength=cells)
    total = np.bincount(cell[inside], weights=values[known][inside], minlength=cells)
    return np.where(number >= max(least, 1), total / np.maximum(number, 1), np.nan)
